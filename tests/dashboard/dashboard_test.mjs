// Usage: node dashboard_test.mjs ROOT [--screenshots FOLDER] [--only PART-OF-A-NAME]. Every test gets a page of its own; one farm serves all
// but those that break it.
import assert from "node:assert/strict";
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { chromium } from "playwright-core";

import { denoisedTests } from "./denoised_tests.mjs";
import { madeUpJob, serveMadeUpFarm } from "./fake_farm.mjs";
import { Farm, kGenerousMs, until } from "./farm.mjs";
import { lightMixTests } from "./light_mix_tests.mjs";
import { overviewTests } from "./overview_tests.mjs";
import { sequenceTests } from "./sequence_tests.mjs";

const root = process.argv[2];
const option = (name) => (process.argv.includes(name) ? process.argv[process.argv.indexOf(name) + 1] : undefined);
const screenshots = option("--screenshots");
const scene = join(root, "scenes/cornell-spheres.pbrt");
const small = ["--integrator", "pt", "--resolution", "96x64"];

const browser = await chromium.launch({
  executablePath: "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-3d-apis", "--disable-quic", "--disable-background-networking"],
});
const farm = new Farm(join(root, "build/release/bin"));
const problems = []; // what pages complained of: violations of the policy, exceptions

async function open(url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(kGenerousMs);
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => {
    // A connection that was cut on purpose is complained of by the browser itself.
    if (message.type() === "error" && !/ERR_|Failed to load resource/.test(message.text())) problems.push(message.text());
  });
  await page.goto(url);
  return page;
}

const live = (page) => page.waitForSelector('.connection[data-state="live"]');
const shot = async (page, name) => {
  if (screenshots) await page.screenshot({ path: join(screenshots, `${name}.png`) });
};
/** The value under a label of the job's page. */
const figure = (page, label) =>
  page.evaluate((wanted) => [...document.querySelectorAll(".job-figures > div")].find((d) => d.firstChild.textContent === wanted)?.lastChild.textContent, label);
/** What the canvas shows in its middle; "" before there is a picture. */
const middle = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector(".stage canvas");
    if (canvas?.dataset.ready !== "true") return "";
    return [...canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data].join();
  });
const drawn = (page) => page.waitForFunction(() => document.querySelector(".stage canvas")?.dataset.ready === "true");

const tests = {
  async "a whole job is watched to its end"() {
    const page = await open(farm.url);
    await live(page);
    const id = await farm.submit(scene, ...small, "--spp", "256", "--target-error", "1e-9", "--name", "watched <b>job</b>");
    // It comes to the list by itself, and its name is text.
    await page.locator(`.vt-row[data-id="${id}"]`, { hasText: "watched <b>job</b>" }).waitFor();
    await page.locator(`.vt-row[data-id="${id}"] a`).click();
    await page.waitForSelector(".viewer");
    await drawn(page);
    await page.locator(".job-head .state", { hasText: "done" }).waitFor();
    assert.equal(await figure(page, "Samples"), "256 / 256");
    assert.match(await figure(page, "relMSE"), /^\d\.\d\de-\d+ {2}\(.* … .*\)$/);
    const told = await (await fetch(`${farm.url}api/v1/jobs/${id}`)).json();
    const scales = [4, 16, 32].map((side) => told[`relmse_${side}`]?.toExponential(2) ?? "–");
    assert.equal(await figure(page, "Over 4, 16, 32 px"), scales.every((text) => text === "–") ? "–" : scales.join(" · "));
    assert.equal(await page.locator(".chart .u-over").count(), 1);
    await page.locator(".panel", { hasText: "256 samples per pixel complete" }).waitFor();
    // The picture is the film's: the middle of the screen is the middle of the image.
    await until("the final picture", async () => /^[1-9]\d*,[1-9]\d*,\d+,255$/.test(await middle(page)));
    const plain = await middle(page);
    await page.keyboard.press("e");
    await page.keyboard.press("e");
    await until("a brighter picture", async () => Number((await middle(page)).split(",")[0]) > Number(plain.split(",")[0]));
    await page.keyboard.press("n");
    await page.waitForSelector(".legend:visible");
    await shot(page, "noise");
    await page.keyboard.press("n");
    await drawn(page);
    const curve = await (await fetch(`${farm.url}api/v1/jobs/${id}/curve`)).json();
    assert.equal(curve.at(-1).spp, 256);
    await page.context().close();
  },

  async "two jobs are compared"() {
    const a = await farm.submit(scene, ...small, "--spp", "16", "--name", "few");
    const b = await farm.submit(scene, ...small, "--spp", "64", "--name", "more");
    const page = await open(`${farm.url}#/jobs/${a}`);
    await page.locator(".job-head .state", { hasText: "done" }).waitFor();
    await until("the second job's end", async () => (await farm.job(b)).state === "done");
    await drawn(page);
    await page.keyboard.press("b");
    await page.locator(`.viewer select[aria-label="Compare with"] option[value="${b}"]`).waitFor({ state: "attached" });
    await page.selectOption('.viewer select[aria-label="Compare with"]', b);
    await page.waitForFunction((other) => location.hash.endsWith(`?b=${other}`), b);
    await page.waitForSelector(".viewer-message", { state: "hidden" });
    await page.locator(".split").focus();
    const before = await page.locator(".split").inputValue();
    for (let i = 0; i < 5; i++) await page.keyboard.press("ArrowLeft");
    assert.ok(Number(await page.locator(".split").inputValue()) < Number(before));
    await shot(page, "compare");
    await page.context().close();
  },

  async "a job is paused, resumed, extended and cancelled by keys alone"() {
    const id = await farm.submit(scene, ...small, "--spp", "1000000", "--name", "keys", "--priority", "-5");
    const page = await open(farm.url, { colorScheme: "dark" });
    await live(page);
    await page.keyboard.press("/");
    await page.keyboard.type("keys");
    await page.waitForFunction(() => document.querySelectorAll(".vt-row:not([hidden])").length === 1);
    await page.keyboard.press("Enter"); // back to the list
    await page.keyboard.press("ArrowDown");
    await page.waitForSelector('.vt-row[aria-selected="true"]');
    assert.equal(await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle), "solid", "the focus must show");
    await page.keyboard.press("Enter");
    await page.waitForSelector(".job-head");
    await page.keyboard.press("p");
    await page.locator(".job-head .state", { hasText: "paused" }).waitFor();
    assert.equal((await farm.job(id)).state, "paused");
    await page.keyboard.press("p");
    await until("it goes on", async () => ["running", "queued"].includes((await farm.job(id)).state));
    await page.keyboard.press("i");
    await page.waitForSelector("dialog[open]");
    await page.keyboard.type("7");
    await page.keyboard.press("Enter");
    await until("the priority", async () => (await farm.job(id)).priority === 7);
    await page.keyboard.press("x");
    await page.waitForSelector("dialog[open]");
    await page.keyboard.type("2000000");
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => document.querySelector(".job-figures").textContent.includes("2.00M"));
    await page.keyboard.press("c");
    await page.waitForSelector("dialog[open]");
    await page.keyboard.press("Escape"); // thought better of it
    assert.notEqual((await farm.job(id)).state, "cancelled");
    await page.keyboard.press("c");
    await page.waitForSelector("dialog[open]");
    await page.keyboard.press("Tab");
    await page.keyboard.press("Enter");
    await page.locator(".job-head .state", { hasText: "cancelled" }).waitFor();
    await page.keyboard.press("?");
    await page.locator("dialog.help[open]", { hasText: "pause, resume" }).waitFor();
    await page.keyboard.press("Escape");
    await page.keyboard.press("g");
    await page.keyboard.press("l");
    await page.locator(".log", { hasText: `${id}: cancel by` }).waitFor();
    // Everything on the jobs' page can be reached by Tab.
    await page.keyboard.press("g");
    await page.keyboard.press("j");
    await page.waitForSelector(".jobs-page");
    const reached = new Set();
    for (let i = 0; i < 40; i++) {
      await page.keyboard.press("Tab");
      reached.add(await page.evaluate(() => document.activeElement.className || document.activeElement.textContent));
    }
    for (const wanted of ["filter", "chip", "vt-scroll"]) assert.ok(reached.has(wanted), `Tab never reached ${wanted}: ${[...reached]}`);
    await page.context().close();
  },

  async "a scene is submitted again with other settings"() {
    const id = await farm.submit(scene, ...small, "--spp", "8", "--name", "first");
    const page = await open(`${farm.url}#/jobs/${id}`);
    await page.locator(".job-head .state", { hasText: "done" }).waitFor();
    await page.keyboard.press("s");
    await page.waitForSelector("dialog[open]");
    await page.fill("dialog input[name=name]", "second");
    await page.fill("dialog input[name=spp]", "12");
    await page.keyboard.press("Enter");
    await page.waitForFunction((old) => /#\/jobs\/j\d+$/.test(location.hash) && !location.hash.endsWith(old), `/${id}`);
    const made = (await page.evaluate(() => location.hash)).split("/").pop();
    await page.locator(".job-head .state", { hasText: "done" }).waitFor();
    const job = await farm.job(made);
    assert.equal(job.name, "second");
    assert.equal(job.spp, 12);
    await page.context().close();
  },

  async "light that no path meets is named"() {
    for (const integrator of ["auto", "bdpt"]) {
      const id = await farm.submit(join(root, "tests/farm/lit_and_seen_by_mirrors.pbrt"), "--spp", "16", "--integrator", integrator);
      const page = await open(`${farm.url}#/jobs/${id}`);
      await page.locator(".job-note", { hasText: /^Missing light: about .* which no path meets/ }).waitFor();
      await shot(page, `missing-light-${integrator}`);
      await page.context().close();
    }
  },

  async "light that was dropped is told"() {
    const path = join(farm.folder, "capped.pbrt");
    writeFileSync(path, 'Film "rgb" "integer xresolution" 64 "integer yresolution" 64 "float maxcomponentvalue" 0.25\nWorldBegin\nLightSource "infinite"\n');
    const id = await farm.submit(path, "--spp", "4", "--integrator", "pt");
    const page = await open(`${farm.url}#/jobs/${id}`);
    await page.locator(".job-note", { hasText: /Dropped light: 16384 samples were brighter than .* % of the image; / }).waitFor();
    await page.context().close();
    // A little is mentioned, but no warning.
    const made = await serveMadeUpFarm(join(root, "build/release/coordinator/dashboard/dist"), 100, 1);
    try {
      const other = await open(`${made.url}#/jobs/j50`);
      await other.waitForSelector(".viewer");
      made.send("jobs", { full: false, rows: [{ ...madeUpJob(50), version: 2, dropped_lines: [{ text: "a little", warning: false }] }] });
      await other.locator(".chart-text", { hasText: /^Dropped: a little\.$/ }).waitFor();
      assert.equal(await other.locator(".job-note", { hasText: "a little" }).count(), 0);
      await other.context().close();
    } finally {
      made.close();
    }
  },

  async "a scene is submitted from the browser"() {
    const folder = join(farm.folder, "project");
    mkdirSync(join(folder, "scenes"), { recursive: true });
    mkdirSync(join(folder, "parts"));
    writeFileSync(join(folder, "scenes/room.pbrt"), 'Film "rgb" "integer xresolution" 80 "integer yresolution" 60\nSampler "sobol" "integer pixelsamples" 8\nWorldBegin\nLightSource "infinite"\nInclude "../parts/ball.pbrt"\n');
    writeFileSync(join(folder, "parts/notes.txt"), "stays here");
    const page = await open(`${farm.url}#/new`);
    await live(page);
    // Something that it refers to is not there.
    await page.locator("input[type=file]").first().setInputFiles(folder);
    await page.locator(".problems .bad", { hasText: /room\.pbrt:5:\d+: .*ball\.pbrt/ }).waitFor();
    assert.equal(await page.evaluate(() => document.activeElement.id), "new-main", "the form has the focus");
    await shot(page, "submit-error");
    // More than a piece, so that it comes in several.
    writeFileSync(join(folder, "parts/ball.pbrt"), `Translate 0 0 4\nShape "sphere"\n${"# padding\n".repeat(300_000)}`);
    await page.keyboard.press("Escape"); // out of the form
    await page.keyboard.press("Escape"); // back to the jobs
    await page.waitForSelector(".jobs-page");
    await page.keyboard.press("g");
    await page.keyboard.press("n");
    await page.locator("input[type=file]").first().setInputFiles(folder);
    await page.locator(".new-status", { hasText: "Ready: 2 files, 3.00 MB · 80 × 60 · 8 samples · depth 5" }).waitFor();
    await page.fill("#new-name", "from a browser");
    await page.fill("#new-spp", "12");
    await page.selectOption("#new-integrator", "pt");
    await shot(page, "submit");
    await page.locator("#new-width").focus(); // a wrong value is told, and nothing is submitted
    await page.keyboard.type("1000000");
    await page.keyboard.press("Enter");
    await page.locator(".problems .bad", { hasText: "width must be a whole number from 1 to 65536" }).waitFor();
    await page.fill("#new-width", "");
    await page.locator("#new-width").press("Enter");
    await page.waitForFunction(() => /#\/jobs\/j\d+$/.test(location.hash));
    const id = (await page.evaluate(() => location.hash)).split("/").pop();
    await page.locator(".job-head .state", { hasText: "done" }).waitFor();
    const job = await farm.job(id);
    assert.equal(job.name, "from a browser");
    assert.equal(job.spp, 12);
    await until("the picture of a ball", async () => /^[1-9]\d*,/.test(await middle(page)));
    // The same scene from a client has nothing left to send, and is the same.
    const again = await farm.submit(join(folder, "scenes/room.pbrt"), "--spp", "1");
    const scene_of = async (job) => (await (await fetch(`${farm.url}api/v1/jobs/${job}`)).json()).detail.scene;
    assert.equal(await scene_of(again), await scene_of(id));
    await page.context().close();
  },

  async "an upload outlives the connection"() {
    const file = join(farm.folder, "lost.pbrt");
    writeFileSync(file, `WorldBegin\nLightSource "infinite"\nShape "sphere"\n${"# x\n".repeat(700_000)}`);
    const page = await open(`${farm.url}#/new`);
    await live(page);
    let cut = 0;
    await page.route("**/api/v1/blobs/**", (route) => (route.request().url().endsWith("offset=1048576") && cut++ < 2 ? route.abort("connectionreset") : route.continue()));
    await page.locator("input[type=file]").last().setInputFiles(file);
    await page.locator(".new-status", { hasText: "Ready: 1 file" }).waitFor();
    assert.equal(cut, 3, "two cuts, and then it went through");
    // Files are dropped on any page.
    await page.goto(`${farm.url}#/log`);
    await page.evaluate(() => {
      const dropped = new DataTransfer();
      dropped.items.add(new File(['WorldBegin\nLightSource "infinite"\nShape "sphere"\n'], "dropped.pbrt"));
      document.body.dispatchEvent(new DragEvent("drop", { bubbles: true, cancelable: true, dataTransfer: dropped }));
    });
    await page.locator(".new-status", { hasText: "Ready: 1 file" }).waitFor();
    assert.equal(await page.locator("#new-main").inputValue(), "dropped.pbrt");
    await page.context().close();
  },

  async "the plan, the tiles and their logs"() {
    const id = await farm.submit(scene, "--resolution", "160x96", "--integrator", "auto", "--spp", "1000000", "--target-error", "1e-7", "--name", "plan");
    const page = await open(`${farm.url}#/jobs/${id}`);
    const panel = (name) => page.locator(`.panel[aria-label="${name}"]`);
    await panel("Plan").locator("tr.chosen", { hasText: "(chosen)" }).waitFor();
    // What lightmill explain says of the scene.
    const explained = JSON.parse(await farm.local("explain", scene, "--json", "--resolution", "160x96", "--integrator", "auto")).items;
    await panel("Scene").locator("tbody tr").first().waitFor();
    const told = await panel("Scene").locator("tbody tr").evaluateAll((rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent).join("|")));
    assert.deepEqual(told.sort(), explained.map((i) => `${i.feature}|${i.needed ? "needed" : "left out"}|${i.reason}${i.saving ? `; saves ${i.saving}` : ""}`).sort());
    assert.ok(told.some((row) => row.includes("left out")));
    // A tile is chosen by keys, and its log is there.
    await panel("Tiles").locator("li", { hasText: "in work for over" }).waitFor();
    await page.locator(".panel p", { hasText: /^[1-9]\d* samples per pixel complete/ }).waitFor();
    await panel("Tiles").locator("canvas").focus();
    await page.keyboard.press("ArrowRight");
    await page.locator(".spoken", { hasText: /tile \d+ · samples/ }).waitFor({ state: "attached" });
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("Enter");
    await panel("Tiles").locator(".tile-log li", { hasText: / · w\d+/ }).first().waitFor();
    await page.selectOption('select[aria-label="Colour by"]', "worker");
    await panel("Tiles").locator(".tile-legend li", { hasText: /^w\d+ / }).first().waitFor();
    await shot(page, "plan");
    // The target alone ends it: progress is that of the error.
    await until("progress towards the target", async () => {
      const job = await (await fetch(`${farm.url}api/v1/jobs/${id}`)).json();
      const shown = parseInt(await page.locator(".job-progress").textContent(), 10);
      return job.relmse_high && Math.abs(shown - (100 * 1e-7) / job.relmse_high) < 2 && job.packets_done / job.packets_total < 0.01;
    });
    await farm.lightmill("cancel", id);
    await page.context().close();
  },

  async "pages can be read by everybody"() {
    const id = await farm.submit(scene, ...small, "--spp", "64", "--name", "readable");
    const sequence = await farm.submit(join(root, "scenes/windmill.gltf"), "--frames", "1-3", "--spp", "16", "--resolution", "64x36");
    // A line for the log.
    await fetch(`${farm.url}api/v1/jobs/${id}/extend`, { method: "POST", headers: { "X-Lightmill": "1" }, body: '{"spp": 70}' });
    for (const colorScheme of ["light", "dark"]) {
      // The checker is a script of our own in the page, which the page's policy would not let in.
      const page = await open(`${farm.url}#/jobs/${id}`, { colorScheme, bypassCSP: true });
      await page.locator(".job-head .state", { hasText: "done" }).waitFor();
      await page.addScriptTag({ path: join(process.cwd(), "node_modules/axe-core/axe.min.js") });
      for (const hash of [`#/jobs/${id}`, "#/jobs", "#/sequences", `#/sequences/${sequence}`, "#/workers", "#/workers/timeline", "#/log", "#/new"]) {
        await page.evaluate((to) => (location.hash = to), hash);
        await page.waitForSelector("main");
        if (hash.endsWith(sequence)) await page.waitForSelector(".film-picture canvas");
        await page.waitForTimeout(300); // transitions
        const { violations } = await page.evaluate(() => globalThis.axe.run());
        const told = violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.slice(0, 3).map((n) => `${n.html.slice(0, 120)} ${n.any.map((a) => a.message).join("; ")}`).join(" | ")}`);
        assert.deepEqual(told, [], `${hash} in ${colorScheme}`);
      }
      await page.context().close();
    }
  },

  async "dark, light and narrow"() {
    const page = await open(farm.url, { colorScheme: "dark" });
    await live(page);
    const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const dark = await background();
    await page.keyboard.press("t"); // light, whatever the system says
    const light = await background();
    const brightness = (rgb) => rgb.match(/\d+/g).slice(0, 3).reduce((sum, v) => sum + Number(v), 0) / 3;
    assert.ok(brightness(dark) < 60 && brightness(light) > 220, `${dark} ${light}`);
    await page.reload();
    assert.equal(await background(), light, "the choice is kept");
    await shot(page, "jobs-light");
    await page.setViewportSize({ width: 390, height: 800 });
    for (const hash of ["#/jobs", "#/sequences", "#/sequences/s1", "#/workers", "#/workers/timeline", "#/log", "#/new", "#/jobs/j1"]) {
      await page.goto(farm.url + hash);
      await page.waitForSelector("main");
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= 390, `${hash} is ${wide} pixels wide on a screen of 390`);
    }
    await page.context().close();
  },

  async "a lost connection is shown, and heals"() {
    const page = await open(farm.url);
    await live(page);
    await page.waitForSelector(".vt-row");
    // It hangs: the connection is there, and nothing comes.
    farm.coordinator.kill("SIGSTOP");
    await page.waitForSelector(".banner:visible");
    assert.match(await page.locator(".banner").textContent(), /^Not live since .*does not answer/);
    await shot(page, "lost");
    farm.coordinator.kill("SIGCONT");
    await live(page);
    await page.waitForSelector(".banner", { state: "hidden" });
    // It dies, and comes back on the same data.
    const id = await farm.submit(scene, ...small, "--spp", "1000000", "--name", "survivor");
    await page.goto(`${farm.url}#/jobs/${id}`);
    await page.locator(".job-head .state", { hasText: /running|queued/ }).waitFor();
    await farm.stop(farm.coordinator);
    await page.waitForSelector(".banner:visible");
    await farm.startCoordinator();
    await live(page);
    await page.waitForSelector(".banner", { state: "hidden" });
    // What happens now is heard of without a reload.
    const spp = async () => parseFloat((await figure(page, "Samples")).replaceAll(",", ""));
    const then = await spp();
    await until("news after the restart", async () => (await spp()) > then);
    await farm.lightmill("cancel", id);
    await page.locator(".job-head .state", { hasText: "cancelled" }).waitFor();
    await page.context().close();
  },

  async "the chart takes any curve"() {
    const made = await serveMadeUpFarm(join(root, "build/release/coordinator/dashboard/dist"), 100, 1);
    try {
      const page = await open(`${made.url}#/jobs/j50`);
      await page.waitForSelector(".viewer");
      let state = 12345; // of a generator of our own: the same curves every time
      const random = () => (state = (state * 1103515245 + 12345) % 2147483648) / 2147483648;
      for (let i = 0; i < 80; i++) {
        const begin = 10 ** (6 * random() - 3);
        const top = 10 ** (14 * random() - 10);
        const points = Array.from({ length: Math.floor(20 * random()) }, (_, k) => ({
          wall_seconds: begin * (1 + k + random() / 2), cpu_seconds: begin * (k + 1), spp: 2 ** k, batches: k,
          ...(k > 0 && { relmse: i % 9 === 0 ? 0 : top / (k + random()) }), ...(k > 3 && { relmse_low: top / (2 * k), relmse_high: top }),
        }));
        const target = { ...madeUpJob(50), ...(i % 2 && { target_error: top * 10 ** (4 * random() - 4) }) };
        made.send("jobs", { full: false, rows: [target] });
        made.send("job", { id: "j50", full: true, detail: { settings: {}, scene: "", crop: [0, 0, 1920, 1080], cell_pixels: 32 }, points, points_from: 0, complete_samples: i });
        await page.locator(".panel", { hasText: `${i} samples per pixel complete` }).waitFor().catch(() => assert.fail(`curve ${i} never came`));
      }
      await page.context().close();
    } finally {
      made.close();
    }
  },

  async "ten thousand jobs and a thousand workers"() {
    const made = await serveMadeUpFarm(join(root, "build/release/coordinator/dashboard/dist"), 10000, 1000);
    try {
      const page = await open(made.url);
      await page.waitForFunction(() => document.querySelector('nav a[data-page="jobs"]').textContent.includes("10,000"));
      const nodes = () => page.evaluate(() => document.getElementsByTagName("*").length);
      const rows = () => page.evaluate(() => [...document.querySelectorAll(".vt-row:not([hidden])")].map((row) => row.dataset.id));
      await page.waitForSelector(".vt-row");
      const few = await nodes();
      assert.ok(few < 1500, `${few} elements for 10,000 jobs`);
      await shot(page, "ten-thousand");
      await page.keyboard.press("End");
      await page.waitForFunction(() => document.querySelector(".vt-scroll").scrollTop > 200000);
      await page.waitForSelector('.vt-row[aria-selected="true"]');
      assert.ok((await nodes()) < few + 400, "scrolling adds elements");
      await page.keyboard.press("Home");
      // Sorted by error, the smallest first.
      await page.getByRole("button", { name: "relMSE" }).click();
      await page.getByRole("button", { name: "relMSE" }).click();
      await page.waitForFunction(() => document.querySelector('.vt-row[aria-rowindex="2"]')?.dataset.id === "j10000");
      // A row changes in place: no element is made for it.
      made.send("jobs", { full: false, rows: [{ ...madeUpJob(10000), version: 2, state: "failed", message: "the disk is full" }] });
      await page.locator('.vt-row[data-id="j10000"]', { hasText: "the disk is full" }).waitFor();
      // What was looked up earlier and comes later does not show.
      made.send("jobs", { full: false, rows: [madeUpJob(10000), { ...madeUpJob(9999), state: "failed", message: "also full" }] });
      await page.locator('.vt-row[data-id="j9999"]', { hasText: "also full" }).waitFor();
      assert.match(await page.locator('.vt-row[data-id="j10000"]').textContent(), /the disk is full/);
      assert.ok((await nodes()) < few + 400);
      await page.fill(".filter", "shot_042 v7 failed");
      await page.waitForFunction(() => document.querySelectorAll(".vt-row:not([hidden])").length < 20);
      assert.ok((await rows()).length > 0);
      await page.goto(`${made.url}#/workers`);
      await page.waitForSelector(".vt-row");
      assert.ok((await nodes()) < 1500);
      await page.locator(".vt-row", { hasText: "silent for" }).first().waitFor();
      await shot(page, "workers");
      await page.context().close();
    } finally {
      made.close();
    }
  },

  ...denoisedTests({ root, farm, open, shot, small, middle, drawn }),
  ...lightMixTests({ root, farm, open, shot, small, middle, drawn }),
  ...overviewTests({ root, farm, open, live, shot, small }),
  ...sequenceTests({ root, farm, open, live, shot }),
};

let passed = 0;
let failed = 0;
try {
  await farm.startCoordinator();
  farm.startWorker(1);
  for (const [name, test] of Object.entries(tests)) {
    if (!name.includes(option("--only") ?? "")) continue;
    const begin = Date.now();
    try {
      await test();
      assert.deepEqual(problems.splice(0), [], "pages complained");
      passed++;
      console.log(`ok      ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`);
    } catch (error) {
      failed++;
      problems.length = 0;
      console.log(`FAILED  ${name}\n${error.stack}`);
    }
  }
} catch (error) {
  failed++;
  console.log(`FAILED  ${error.stack}`);
} finally {
  if (failed) console.log(`--- coordinator\n${farm.log("lightmill-coordinator")}\n--- worker\n${farm.log("lightmill-worker")}`);
  await browser.close();
  await farm.close();
}
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed ? 1 : 0);
