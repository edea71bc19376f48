// The frame around the pages: where we are, whether the numbers are live, keys and colours.
import "./style.css";
import "./sequences/sequences.css";
import "./activity/activity.css";
import "./light_mix/light_mix.css";

import { installToasts } from "./actions";
import { timelinePage } from "./activity/timeline_page";
import { Cleanup, h, setText } from "./dom";
import * as format from "./format";
import { showHelp } from "./help";
import { jobPage } from "./job_page";
import { jobsPage } from "./jobs_page";
import { logPage } from "./log_page";
import { installDrop, newJobPage } from "./new_job_page";
import { sequencesPage } from "./sequences/list_page";
import { sequencePage } from "./sequences/sequence_page";
import { store } from "./store";
import { startStream } from "./stream";
import { workersPage } from "./workers_page";

interface Page {
  element: HTMLElement;
  key: (key: string) => boolean;
}

const kThemes = ["system", "light", "dark"] as const;
type Theme = (typeof kThemes)[number];
const systemIsDark = matchMedia("(prefers-color-scheme: dark)");

const links = [["jobs", "Jobs"], ["sequences", "Sequences"], ["workers", "Workers"], ["log", "Log"], ["new", "New job"]] as const;
const nav = links.map(([key, label]) => h("a", { href: `#/${key}`, "data-page": key }, label, h("small")));
const connection = h("span", { class: "connection", role: "status" });
const user = h("span", { class: "muted" });
const themeButton = h("button", { type: "button", title: "colours: as the system, light, dark (t)", onclick: () => nextTheme() });
const banner = h("div", { class: "banner", role: "alert", hidden: true });
const outlet = h("div", { class: "outlet" });

let page: Page | undefined;
let cleanup = new Cleanup();

function route(): void {
  cleanup.run();
  cleanup = new Cleanup();
  const [path, query] = location.hash.replace(/^#\/?/, "").split("?");
  const [name, id] = (path || "jobs").split("/");
  const parameter = (key: string) => new URLSearchParams(query ?? "").get(key) ?? "";
  document.title = "Lightmill";
  if (name === "jobs" && id) page = jobPage(decodeURIComponent(id), parameter("b"), cleanup);
  else if (name === "sequences" && id) page = sequencePage(decodeURIComponent(id), parameter("frame"), cleanup);
  else if (name === "sequences") page = sequencesPage(cleanup);
  else if (name === "workers" && id === "timeline") page = timelinePage(cleanup);
  else if (name === "workers") page = workersPage(cleanup);
  else if (name === "log") page = logPage(cleanup);
  else if (name === "new") page = newJobPage(cleanup);
  else page = jobsPage(cleanup);
  outlet.replaceChildren(page.element);
  // Tab goes on from here, and a screen reader says where we are; lists then take the focus themselves.
  page.element.id = "main";
  page.element.tabIndex = -1;
  page.element.focus({ preventScroll: true });
  for (const link of nav) {
    if (link.dataset["page"] === (name || "jobs")) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
}

function theme(): Theme {
  const saved = localStorage.getItem("theme");
  return kThemes.find((t) => t === saved) ?? "system";
}

function applyTheme(): void {
  const chosen = theme();
  const dark = chosen === "system" ? systemIsDark.matches : chosen === "dark";
  document.documentElement.dataset["theme"] = dark ? "dark" : "light";
  setText(themeButton, { system: "◐", light: "○", dark: "●" }[chosen]);
  themeButton.setAttribute("aria-label", `Colours: ${chosen}`);
  document.dispatchEvent(new Event("themechange"));
}

function nextTheme(): void {
  localStorage.setItem("theme", kThemes[(kThemes.indexOf(theme()) + 1) % kThemes.length]!);
  applyTheme();
}

function frame(): void {
  const counted = (key: string, count: number) => setText(nav.find((link) => link.dataset["page"] === key)!.lastElementChild!, count ? ` ${format.count(count)}` : "");
  counted("jobs", store.jobs.size);
  counted("workers", store.workers.size);
  setText(user, store.session?.roles ? `${store.session.user}${store.session.may_act ? "" : " (looks only)"}` : "");
  const now = store.connection;
  connection.dataset["state"] = now.state;
  setText(connection, { live: "live", lost: "reconnecting…", connecting: "connecting…" }[now.state]);
  banner.hidden = now.state !== "lost";
  document.body.classList.toggle("stale", now.state === "lost");
  if (now.state === "lost") setText(banner, `Not live since ${format.logTime(now.since / 1000)}: ${now.why}. What you see is from then; trying again.`);
}

let going = 0; // until when a letter after "g" goes somewhere

function onKey(event: KeyboardEvent): void {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
  const target = event.target as HTMLElement;
  if (event.key === " " && target.matches("button, a")) return; // it presses them
  const typing = target.matches("input:not([type=range]), select, textarea");
  if (typing) {
    if (event.key === "Escape") (document.querySelector<HTMLElement>(".vt-scroll, .film-scroll, .log, .viewer canvas") ?? page?.element)?.focus();
    else if (event.key === "Enter" && target.matches(".filter")) document.querySelector<HTMLElement>(".vt-scroll")?.focus();
    return;
  }
  if (event.key === "?") showHelp();
  else if (event.key === "t") nextTheme();
  else if (event.key === "g") going = Date.now() + 1500;
  else if (Date.now() < going && ["j", "s", "w", "l", "n"].includes(event.key)) {
    going = 0;
    location.hash = { j: "#/jobs", s: "#/sequences", w: "#/workers", l: "#/log", n: "#/new" }[event.key]!;
  } else if (!page?.key(event.key)) return;
  event.preventDefault();
}

document.querySelector("#app")!.append(
  h("a", { class: "skip", href: "#main", onclick: (event: Event) => { event.preventDefault(); document.querySelector<HTMLElement>(".film-scroll, .vt-scroll, .viewer canvas, .log")?.focus(); } }, "Skip to content"),
  h("header", { class: "top" }, h("strong", {}, "Lightmill"), h("nav", { "aria-label": "Pages" }, ...nav), h("span", { class: "grow" }), connection, user, themeButton,
    h("button", { type: "button", title: "keys (?)", "aria-label": "Keys", onclick: showHelp }, "?")),
  banner,
  outlet,
  installToasts(),
);
applyTheme();
installDrop();
systemIsDark.addEventListener("change", applyTheme);
window.addEventListener("hashchange", route);
document.addEventListener("keydown", onKey);
store.watch(frame);
frame();
route();
startStream();
