// Thumbnails in lists, why a job waits, and the timeline of the workers.
import assert from "node:assert/strict";
import { join } from "node:path";

import { serveMadeUpFarm } from "./fake_farm.mjs";
import { thumbnail } from "./fake_sequence.mjs";
import { MadeUpTimeline } from "./fake_timeline.mjs";
import { until } from "./farm.mjs";

/** A colour of a canvas's middle. */
const middle = (locator) => locator.evaluate((canvas) => [...canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data].join());

export function overviewTests({ root, farm, open, live, shot, small }) {
  const dist = join(root, "build/release/coordinator/dashboard/dist");
  const scene = join(root, "scenes/cornell-spheres.pbrt");
  return {
    async "lists show thumbnails"() {
      const id = await farm.submit(scene, ...small, "--spp", "32", "--name", "with a picture");
      const page = await open(farm.url);
      await live(page);
      const picture = page.locator(`.vt-row[data-id="${id}"] .thumb canvas`);
      await picture.waitFor();
      await until("its colours", async () => /^[1-9]\d*,[1-9]\d*,\d+,255$/.test(await middle(picture)));
      assert.ok((await picture.evaluate((canvas) => Math.max(canvas.width, canvas.height))) <= 96);
      await shot(page, "jobs-thumbnails");
      // What is there once is not asked for again.
      const asked = [];
      page.on("request", (request) => { if (request.url().endsWith("/thumbnail")) asked.push(request.url()); });
      await page.keyboard.press("ArrowDown");
      await page.waitForTimeout(500);
      assert.ok(!asked.some((url) => url.includes(`/${id}/`)), asked.join());
      await page.context().close();
    },

    async "ten thousand jobs fetch the thumbnails in sight"() {
      const asked = new Set();
      const made = await serveMadeUpFarm(dist, 10000, 1, (request, response) => {
        const job = /^\/api\/v1\/jobs\/(j\d+)\/thumbnail$/.exec(request.url);
        if (!job) return false;
        asked.add(job[1]);
        if (job[1].endsWith("3")) response.writeHead(204).end(); // none yet
        else response.writeHead(200, { "Content-Type": "image/png" }).end(thumbnail(Number(job[1].slice(1)) / 10000));
        return true;
      });
      try {
        const page = await open(made.url);
        await until("the first ones", () => asked.size > 10);
        await page.waitForTimeout(300);
        await page.waitForFunction(() => document.querySelectorAll(".thumb canvas").length > 10);
        await shot(page, "ten-thousand-thumbnails");
        assert.ok(asked.size < 60, `${asked.size} thumbnails for those in sight`);
        const frames = await page.evaluate(async () => {
          const list = document.querySelector(".vt-scroll");
          const gaps = [];
          for (let i = 1, last = performance.now(); i <= 120; i++) {
            list.scrollTop = (i / 120) * 0.5 * list.scrollHeight;
            const now = await new Promise(requestAnimationFrame);
            gaps.push(now - last);
            last = now;
          }
          return gaps.sort((a, b) => a - b);
        });
        await page.waitForTimeout(500);
        assert.ok(asked.size < 2500, `${asked.size} thumbnails while scrolling through half of the list`);
        console.log(`        10000 jobs: ${frames[60].toFixed(1)} ms a frame while scrolling (worst ${frames[119].toFixed(0)}), ${asked.size} thumbnails asked for`);
        await page.context().close();
      } finally {
        made.close();
      }
    },

    async "a job that waits says which is before it, and when its turn comes"() {
      const high = await farm.submit(scene, ...small, "--spp", "1000000", "--priority", "9", "--name", "before");
      const low = await farm.submit(scene, ...small, "--spp", "16", "--name", "behind");
      const page = await open(`${farm.url}#/jobs/${low}`);
      await page.locator(".job-note", { hasText: `waits behind job ${high}, whose priority is higher (9, not 0)` }).waitFor();
      await page.locator(".job-note", { hasText: /its turn comes in about \d+ (min|h|days)/ }).waitFor();
      await shot(page, "waiting");
      const told = JSON.parse(await farm.lightmill("job", low, "--json"));
      assert.equal(told.waits_behind, high);
      assert.match(told.waiting, /whose priority is higher/);
      assert.ok(told.turn_seconds > 0);
      assert.match(await farm.lightmill("job", low), /\nturn {6}comes in about /);
      await page.locator(".job-note a").click();
      await page.waitForFunction((hash) => location.hash === hash, `#/jobs/${high}`);
      await page.goto(`${farm.url}#/jobs`);
      const state = page.locator(`.vt-row[data-id="${low}"] .state`);
      await until("the tooltip", async () => /waits behind/.test((await state.getAttribute("title")) ?? ""));
      await farm.lightmill("cancel", high);
      await page.locator(`.vt-row[data-id="${low}"]`, { hasText: "done" }).waitFor();
      await page.context().close();
    },

    async "the timeline shows what a worker did"() {
      // A cell is the job's that took most of it: this one lasts until it is seen, on any machine.
      const id = await farm.submit(scene, ...small, "--spp", "1000000", "--name", "on the timeline");
      const page = await open(`${farm.url}#/workers`);
      await live(page);
      await page.waitForSelector(".vt-row");
      await page.keyboard.press("v");
      await page.waitForFunction(() => location.hash === "#/workers/timeline");
      await page.waitForSelector("canvas.lane");
      await page.locator(".figure", { hasText: /^\d+ %of the workers' time/ }).waitFor();
      await page.keyboard.press("ArrowDown");
      await page.locator(".lane-readout", { hasText: /^w\d+ \S+ · busy for / }).waitFor();
      await page.keyboard.press("ArrowLeft");
      await page.locator(".lane-readout", { hasText: /\d\d:\d\d:\d\d – (now|\d\d:\d\d:\d\d) · \d+ tiles? · busy \d+ %/ }).waitFor();
      await page.locator(".tile-legend a", { hasText: id }).waitFor();
      await page.keyboard.press("Enter");
      await page.waitForFunction(() => /^#\/jobs\/[js]\d+/.test(location.hash));
      await farm.lightmill("cancel", id);
      await page.context().close();
    },

    async "a thousand workers on the timeline"() {
      const timeline = new MadeUpTimeline(1000, 1);
      const made = await serveMadeUpFarm(dist, 100, 1000, (request, response) => timeline.answer(request, response));
      try {
        for (const colorScheme of ["light", "dark"]) {
          timeline.cells = 1;
          const page = await open(`${made.url}#/workers`, { colorScheme });
          await page.waitForSelector(".vt-row");
          const begin = Date.now();
          await page.keyboard.press("v");
          await page.waitForSelector("canvas.lane");
          const painted = Date.now() - begin;
          const frames = await page.evaluate(async () => {
            const list = document.querySelector(".vt-scroll");
            const gaps = [];
            for (let i = 1, last = performance.now(); i <= 120; i++) {
              list.scrollTop = (i / 120) * list.scrollHeight;
              const now = await new Promise(requestAnimationFrame);
              gaps.push(now - last);
              last = now;
            }
            return gaps.sort((a, b) => a - b);
          });
          assert.ok((await page.evaluate(() => document.getElementsByTagName("*").length)) < 1500);
          // The next look brings what is new.
          const looks = timeline.asked.length;
          timeline.cell += 2;
          // The first one may still have been under way.
          const since = () => timeline.asked.slice(looks).map((query) => Number(query.match(/since=(\d+)$/)?.[1])).find((cell) => cell > 0);
          await until("the next look", () => since() !== undefined);
          assert.ok(since() === timeline.cell - 3 || since() === timeline.cell - 1, `since ${since()} at ${timeline.cell}`);
          console.log(`        1000 workers, 360 spans each, ${colorScheme}: first lanes after ${painted} ms; ${frames[60].toFixed(1)} ms a frame while scrolling (worst ${frames[119].toFixed(0)})`);
          timeline.cells = 24;
          await page.reload();
          await page.waitForSelector("canvas.lane");
          await page.locator("canvas.lane").nth(4).hover({ position: { x: 200, y: 12 } });
          await page.locator(".lane-readout", { hasText: /^w\d+ node\d+ · .* busy 95 % · mostly j\d+ shot_/ }).waitFor();
          await page.waitForTimeout(300);
          await shot(page, `timeline-${colorScheme}`);
          await page.getByRole("button", { name: "Busy" }).click();
          await page.getByRole("button", { name: "Busy" }).click();
          await page.locator('.vt-row[aria-rowindex="2"]', { hasText: "47 %" }).waitFor();
          await page.fill(".filter", "node0999");
          await page.waitForFunction(() => document.querySelectorAll(".vt-row:not([hidden])").length === 1);
          await page.context().close();
        }
      } finally {
        made.close();
      }
    },
  };
}
