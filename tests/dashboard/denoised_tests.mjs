// The switch "Denoised" of a job's picture: on a real farm, and with answers of a made-up one.
import assert from "node:assert/strict";
import { join } from "node:path";

import { madeUpJob, serveMadeUpFarm } from "./fake_farm.mjs";
import { picture } from "./fake_sequence.mjs";
import { until } from "./farm.mjs";

const note = (page, text) => page.locator(".viewer-note", { hasText: text }).waitFor();
const pressed = (page, name) => page.getByRole("button", { name, exact: true }).getAttribute("aria-pressed");

export function denoisedTests({ root, farm, open, shot, small, middle, drawn }) {
  const scene = join(root, "scenes/cornell-spheres.pbrt");
  return {
    async "a job is shown denoised, with the error that is left"() {
      const id = await farm.submit(scene, ...small, "--spp", "32", "--aov", "denoise", "--name", "with layers");
      const page = await open(`${farm.url}#/jobs/${id}`);
      await page.locator(".job-head .state", { hasText: "done" }).waitFor();
      await drawn(page);
      await page.getByRole("button", { name: "Denoised", exact: true }).click();
      await note(page, /^Estimated relMSE \d\.\d\de-\d+, before \d\.\d\de-\d+\. By difference, albedo, normal, depth\.$/);
      const [left, before] = (await page.locator(".viewer-note").textContent()).match(/\d\.\d\de-\d+/g).map(Number);
      assert.ok(left < before, `${left} of ${before}`);
      await drawn(page);
      assert.equal(await pressed(page, "Denoised"), "true");
      await shot(page, "denoised");
      await page.keyboard.press("o");
      await page.waitForSelector(".viewer-note", { state: "hidden" });
      assert.equal(await pressed(page, "Denoised"), "false");
      await page.context().close();
      // Without layers it says what would be better.
      const plain = await farm.submit(scene, ...small, "--spp", "16", "--name", "without layers");
      const other = await open(`${farm.url}#/jobs/${plain}`);
      await other.locator(".job-head .state", { hasText: "done" }).waitFor();
      await other.keyboard.press("o");
      await note(other, /By the colour alone\. The noise is guessed: --aov denoise at submission makes it better\.$/);
      await drawn(other);
      await other.context().close();
    },

    async "a denoised picture follows the job"() {
      const asked = []; // the tags that the page had
      let answer = (response) => response.writeHead(204).end();
      const shows = (tag, share, headers) => {
        answer = (response, had) => {
          const all = { ETag: tag, "Content-Type": "application/octet-stream", "X-Lightmill-Relmse": "0.001", "X-Lightmill-Relmse-Raw": "0.02", ...headers };
          if (had === tag) response.writeHead(304, all).end();
          else response.writeHead(200, all).end(picture(share));
        };
      };
      const made = await serveMadeUpFarm(join(root, "build/release/coordinator/dashboard/dist"), 100, 1, (request, response) => {
        if (request.url !== "/api/v1/jobs/j50/denoised") return false;
        asked.push(request.headers["if-none-match"] ?? "");
        answer(response, request.headers["if-none-match"]);
        return true;
      });
      try {
        const page = await open(`${made.url}#/jobs/j50`);
        await page.waitForSelector(".viewer");
        await page.getByRole("button", { name: "Denoised", exact: true }).click();
        await page.locator(".viewer-message", { hasText: "being denoised" }).waitFor();
        shows('"1"', 0.2, { "X-Lightmill-Block": "2", "X-Lightmill-Stale": "1" });
        await note(page, "Estimated relMSE 1.00e-3, before 2.00e-2, of means over 2 × 2 pixels: the image is too large to be denoised whole here. By the colour alone. The noise is guessed: --aov denoise at submission makes it better. A newer one is being made.");
        await drawn(page);
        const first = await middle(page);
        // It asks again while a newer one is made, and what it has is not sent again.
        await until("a question with a tag", () => asked.filter((tag) => tag === '"1"').length > 1);
        assert.equal(await middle(page), first);
        shows('"2"', 0.9, { "X-Lightmill-Block": "1", "X-Lightmill-Layers": "difference,albedo" });
        await note(page, /^Estimated relMSE 1\.00e-3, before 2\.00e-2\. By difference, albedo\.$/);
        await until("the newer picture", async () => Number((await middle(page)).split(",")[0]) > Number(first.split(",")[0]));
        assert.ok(!asked.includes('"2"'), "it is not out of date");
        // The job gets on.
        made.send("jobs", { full: false, rows: [{ ...madeUpJob(50), version: 3, spp: 60 }] });
        await until("a question after that", () => asked.includes('"2"'));
        // The switches exclude each other.
        await page.keyboard.press("n");
        await page.waitForSelector(".viewer-note", { state: "hidden" });
        assert.deepEqual([await pressed(page, "Noise"), await pressed(page, "Denoised")], ["true", "false"]);
        await page.context().close();
      } finally {
        made.close();
      }
    },
  };
}
