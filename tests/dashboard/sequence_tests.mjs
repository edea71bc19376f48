// Sequences in the dashboard: a real one, and one of ten thousand made-up frames.
import assert from "node:assert/strict";
import { join } from "node:path";

import { serveMadeUpFarm } from "./fake_farm.mjs";
import { MadeUpSequence } from "./fake_sequence.mjs";
import { until } from "./farm.mjs";

/** The number of the frame that the player shows in full; "" before there is its picture. */
const shown = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector(".player canvas");
    return canvas?.dataset.ready === "true" ? canvas.dataset.frame : "";
  });
const shows = (page, number) => page.waitForFunction((n) => document.querySelector(".player canvas")?.dataset.frame === n && document.querySelector(".player canvas").dataset.ready === "true", String(number));
const chosen = (page) => page.locator('.film-cell[aria-selected="true"]').textContent();

export function sequenceTests({ root, farm, open, live, shot }) {
  const dist = join(root, "build/release/coordinator/dashboard/dist");
  const windmill = join(root, "scenes/windmill.gltf");
  return {
    async "a sequence is watched, played and changed"() {
      const id = await farm.submit(windmill, "--frames", "1-6", "--fps", "12", "--spp", "32", "--resolution", "64x36", "--name", "six <b>frames</b>");
      const page = await open(farm.url);
      await live(page);
      await page.keyboard.press("g");
      await page.keyboard.press("s");
      const row = page.locator(`.vt-row[data-id="${id}"]`, { hasText: "six <b>frames</b>" });
      await row.waitFor();
      await row.locator("text=6 / 6").waitFor();
      await row.click();
      await page.keyboard.press("Enter");
      await page.locator(".job-head .state", { hasText: "done" }).waitFor();
      await page.waitForFunction(() => document.querySelectorAll(".film-picture canvas").length === 6);
      assert.equal(await page.evaluate(() => document.activeElement.className), "film-scroll", "the filmstrip has the focus");
      await shows(page, 1);
      await page.keyboard.press("ArrowRight");
      await shows(page, 2);
      assert.match(await chosen(page), /^2done/);
      await page.keyboard.press("End");
      await shows(page, 6);
      await page.keyboard.press("ArrowLeft");
      await shows(page, 5);
      await page.keyboard.press("Home");
      await shows(page, 1);
      assert.match(await page.evaluate(() => location.hash), /\?frame=1$/);
      // It plays by itself, round and round; without the loop it ends with the last frame.
      await page.keyboard.press("Space");
      const seen = new Set();
      await until("all frames played", async () => seen.add(await shown(page)).size >= 6 || undefined);
      await page.keyboard.press("l");
      await page.locator('.player button[aria-label="Play"]').waitFor();
      await shows(page, 6);
      // A point of a chart chooses its frame, and so does the bar below the picture.
      const plot = page.locator('.panel[aria-label="Error by frame"] .u-over');
      const box = await plot.boundingBox();
      await plot.hover({ position: { x: 3, y: box.height / 2 } });
      await plot.click({ position: { x: 3, y: box.height / 2 } });
      await shows(page, 1);
      await page.locator(".panel p", { hasText: /^frame 1: relMSE \d\.\d\de-\d+$/ }).waitFor();
      await page.locator(".scrub").focus();
      await page.keyboard.press("ArrowRight");
      await shows(page, 2);
      assert.equal(await page.locator(".scrub").getAttribute("aria-valuetext"), "frame 2");
      // A frame has its own page, and is no row among the jobs.
      await page.locator(".film-scroll").focus();
      await page.keyboard.press("Enter");
      await page.waitForFunction((hash) => location.hash === hash, `#/jobs/${id}.2`);
      await page.locator(".job-head .state", { hasText: "done" }).waitFor();
      await page.waitForFunction(() => document.querySelector(".stage canvas")?.dataset.ready === "true");
      await page.keyboard.press("Escape");
      await page.waitForFunction((hash) => location.hash === hash, `#/sequences/${id}?frame=2`);
      await shows(page, 2);
      await page.goto(`${farm.url}#/jobs`);
      await page.waitForSelector(".jobs-page");
      assert.equal(await page.locator(`.vt-row[data-id^="${id}."]`).count(), 0);
      await page.context().close();
    },

    async "a sequence is paused, resumed, extended and cancelled by keys"() {
      const id = await farm.submit(windmill, "--frames", "1-3", "--spp", "1000000", "--resolution", "64x36", "--name", "keys", "--priority", "-5");
      const page = await open(`${farm.url}#/sequences/${id}`);
      await page.locator(".job-head .state", { hasText: /running|queued/ }).waitFor();
      const told = async () => (await (await fetch(`${farm.url}api/v1/sequences/${id}`)).json()).sequence;
      await page.keyboard.press("p");
      await page.locator(".job-head .state", { hasText: "paused" }).waitFor();
      assert.equal((await told()).frames.paused, 3);
      await page.keyboard.press("p");
      await until("it goes on", async () => (await told()).frames.paused === 0);
      await page.keyboard.press("i");
      await page.waitForSelector("dialog[open]");
      await page.keyboard.type("7");
      await page.keyboard.press("Enter");
      await until("the priority", async () => (await told()).priority === 7);
      await page.keyboard.press("x");
      await page.waitForSelector("dialog[open]");
      await page.keyboard.type("2000000");
      await page.keyboard.press("Enter");
      await until("more samples", async () => (await (await fetch(`${farm.url}api/v1/jobs/${id}.3`)).json()).spp_total === 2000000);
      await page.keyboard.press("c");
      await page.waitForSelector("dialog[open]");
      await page.getByRole("button", { name: "Cancel the sequence" }).click();
      await page.locator(".job-head .state", { hasText: "cancelled" }).waitFor();
      await page.locator(".film-cell .state", { hasText: "cancelled" }).last().waitFor();
      await page.keyboard.press("g");
      await page.keyboard.press("l");
      await page.locator(".log", { hasText: `sequence ${id}: cancel by` }).locator(`a[href="#/sequences/${id}"]`).first().waitFor();
      await page.context().close();
    },

    async "frames that failed are told, and tried again"() {
      const sequence = new MadeUpSequence(40);
      sequence.change(17, { state: "failed", spp: 0, message: "the scene's file is missing" });
      let retried = 0;
      const made = await serveMadeUpFarm(dist, 10, 1, (request, response) => {
        if (request.method !== "POST") return sequence.answer(request, response);
        assert.equal(request.url, "/api/v1/jobs/s1.17/retry");
        assert.equal(request.headers["x-lightmill"], "1");
        retried++;
        sequence.change(17, { state: "queued", message: undefined });
        response.writeHead(200, { "Content-Type": "application/json" }).end(JSON.stringify({ job: { id: "s1.17", version: sequence.version } }));
        return true;
      });
      try {
        const page = await open(`${made.url}#/sequences/s1?frame=17`);
        await page.locator(".failed-frames .vt-row", { hasText: "the scene's file is missing" }).waitFor();
        await page.locator(".viewer-message", { hasText: "failed: the scene's file is missing" }).waitFor();
        await shot(page, "sequence-failed");
        await page.getByRole("button", { name: "Retry frame" }).click();
        await page.locator(".failed-frames").waitFor({ state: "hidden" });
        await page.locator('.film-cell[aria-selected="true"]', { hasText: "17queued" }).waitFor();
        assert.equal(retried, 1);
        await page.context().close();
      } finally {
        made.close();
      }
    },

    async "ten thousand frames"() {
      const count = 10000;
      const sequence = new MadeUpSequence(count);
      const made = await serveMadeUpFarm(dist, 10, 1, (request, response) => sequence.answer(request, response));
      try {
        const page = await open(`${made.url}#/sequences`);
        await page.locator(".vt-row", { hasText: "10,000 / 10,000" }).waitFor();
        const begin = Date.now();
        await page.goto(`${made.url}#/sequences/s1`);
        await page.waitForSelector(".film-picture canvas");
        const painted = Date.now() - begin;
        await page.waitForFunction((n) => document.querySelector(".film-cell").getAttribute("aria-setsize") === n, String(count));
        const nodes = () => page.evaluate(() => document.getElementsByTagName("*").length);
        const few = await nodes();
        assert.ok(few < 600, `${few} elements for ${count} frames`);
        assert.ok(sequence.pictures.length < 40, `${sequence.pictures.length} pictures were fetched for those in sight`);
        // Later looks bring what changed, in place, and nothing else.
        await until("a look that brings nothing", () => sequence.looks.at(-1) === 0);
        assert.equal(sequence.looks.reduce((sum, n) => sum + n, 0), count, "all frames came once");
        sequence.change(3, { state: "failed", message: "the disk is full" });
        await page.locator('.film-cell[data-id="s1.3"]', { hasText: "failed" }).waitFor();
        assert.equal(sequence.looks.reduce((sum, n) => sum + n, 0), count + 1);
        assert.equal(await nodes() < few + 60, true, "a frame changes in place, but for the table of those that failed");
        // Scrolling through all of it asks for the pictures of where it stops.
        const before = sequence.pictures.length;
        const frames = await page.evaluate(async () => {
          const strip = document.querySelector(".film-scroll");
          const gaps = [];
          for (let i = 1, last = performance.now(); i <= 120; i++) {
            strip.scrollLeft = (i / 120) * 0.5 * strip.scrollWidth;
            const now = await new Promise(requestAnimationFrame);
            gaps.push(now - last);
            last = now;
          }
          return gaps.sort((a, b) => a - b);
        });
        await page.waitForFunction(() => document.querySelectorAll(".film-cell:not([hidden]) canvas").length > 8);
        assert.ok(sequence.pictures.length - before < 60, `${sequence.pictures.length - before} pictures while scrolling`);
        assert.ok((await nodes()) < few + 60, "scrolling adds elements");
        await page.keyboard.press("End");
        await shows(page, count);
        assert.match(await chosen(page), /^10000done/);
        await page.keyboard.press("Home");
        await page.keyboard.press("Space");
        await until("it plays", async () => Number(await shown(page)) > 12);
        await shot(page, "ten-thousand-frames");
        console.log(`        ${count} frames: first thumbnail after ${painted} ms, ${few} elements; ${frames[60].toFixed(1)} ms a frame while scrolling (worst ${frames[119].toFixed(0)})`);
        await page.context().close();
      } finally {
        made.close();
      }
    },
  };
}
