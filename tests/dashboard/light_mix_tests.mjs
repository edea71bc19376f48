// The panel that mixes a job's light groups: on a real farm, and with answers of a made-up one.
import assert from "node:assert/strict";
import { join } from "node:path";

import { serveMadeUpFarm } from "./fake_farm.mjs";
import { picture } from "./fake_sequence.mjs";
import { until } from "./farm.mjs";

const pressed = (page, name) => page.getByRole("button", { name, exact: true }).getAttribute("aria-pressed");
const rgb = (text) => text.split(",").slice(0, 3).map(Number);

/** The value of a half float's bits. */
function half(bits) {
  const exponent = (bits >> 10) & 31;
  return exponent === 0 ? (bits & 1023) * 2 ** -24 : (1 + (bits & 1023) / 1024) * 2 ** (exponent - 15);
}

/** The mean of a light mix, once it shows all that the job has. */
async function meanOf(farm, id, mix) {
  const answer = await until("the light mix", async () => {
    const got = await fetch(`${farm.url}api/v1/jobs/${id}/light-mix?mix=${encodeURIComponent(mix)}`);
    assert.ok(got.status === 200 || got.status === 204, await got.clone().text());
    return got.status === 200 && !got.headers.has("X-Lightmill-Stale") && got;
  });
  const values = new Uint16Array(await answer.arrayBuffer(), 16);
  return values.reduce((sum, bits) => sum + half(bits), 0) / values.length;
}

export function lightMixTests({ root, farm, open, shot, small, middle, drawn }) {
  const dist = join(root, "build/release/coordinator/dashboard/dist");
  return {
    async "a job's lights are mixed anew"() {
      const id = await farm.submit(join(root, "scenes/three-lamps.pbrt"), ...small, "--spp", "16", "--aov", "lightgroups", "--name", "lamps");
      const page = await open(`${farm.url}#/jobs/${id}`);
      await page.locator(".job-head .state", { hasText: "done" }).waitFor();
      const panel = page.getByRole("region", { name: "Light mix" });
      await panel.waitFor();
      assert.deepEqual(await panel.locator(".mix-row .cut").allTextContents(), ["key", "fill", "rim", "rest"]);
      await drawn(page);
      const plain = await middle(page);
      // A slider by keys alone.
      await page.getByRole("slider", { name: "key: exposure in stops" }).focus();
      for (let i = 0; i < 10; i++) await page.keyboard.press("ArrowRight");
      assert.equal(await page.getByRole("slider", { name: "key: exposure in stops" }).getAttribute("aria-valuetext"), "+1 stops");
      assert.equal(await page.getByRole("spinbutton", { name: "key: factor" }).inputValue(), "2");
      assert.equal(await pressed(page, "Light mix"), "true");
      await page.locator(".viewer-note", { hasText: "Light mix of the image as it was rendered" }).waitFor();
      await until("a brighter picture", async () => rgb(await middle(page))[0] > rgb(plain)[0]);
      // A number and a colour, and the command that does the same.
      await page.getByRole("spinbutton", { name: "rim: factor" }).fill("0");
      await page.getByLabel("fill: colour").fill("#ff0000");
      const command = `lightmill mix ${id}.exr key=2 fill=1,0,0 rim=0 -o ${id}-mix.exr`;
      await until("the command", async () => (await panel.locator(".mix-command").textContent()) === command);
      await shot(page, "light-mix");
      // The tool makes the same of the job's EXR.
      const exr = join(farm.folder, `${id}.exr`);
      await farm.lightmill("fetch", id, "-o", exr);
      await farm.local("mix", exr, "key=2", "fill=1,0,0", "rim=0", "-o", join(farm.folder, "mix.exr"), "--quiet");
      const listed = JSON.parse(await farm.local("mix", join(farm.folder, "mix.exr"), "--json"));
      const wanted = listed.groups.reduce((sum, group) => sum + group.mean.reduce((a, b) => a + b) / 3, 0);
      const mean = await meanOf(farm, id, "key:2,fill:1/0/0,rim:0");
      assert.ok(Math.abs(mean - wanted) < 2e-3 * wanted, `${mean}, not ${wanted}`);
      // The switches exclude each other, and the sliders stay.
      await page.getByRole("button", { name: "Noise", exact: true }).click();
      assert.deepEqual([await pressed(page, "Noise"), await pressed(page, "Light mix")], ["true", "false"]);
      await page.locator(".stage canvas").focus();
      await page.keyboard.press("m");
      assert.deepEqual([await pressed(page, "Noise"), await pressed(page, "Light mix")], ["false", "true"]);
      await page.keyboard.press("o");
      assert.deepEqual([await pressed(page, "Denoised"), await pressed(page, "Light mix")], ["true", "false"]);
      assert.equal(await panel.locator(".mix-command").textContent(), command);
      await page.keyboard.press("o");
      await page.getByRole("button", { name: "Reset", exact: true }).click();
      assert.equal(await page.getByRole("spinbutton", { name: "key: factor" }).inputValue(), "1");
      await until("the image as it was", async () => (await middle(page)) === plain);
      await page.context().close();
      const bytes = async (path) => Buffer.from(await (await fetch(`${farm.url}api/v1/jobs/${id}/${path}`)).arrayBuffer());
      assert.ok((await bytes("light-mix")).equals(await bytes("image")), "no mix is no change");
      // What is wrong gets a sentence.
      for (const mix of ["lamp:1", "key:nan", "key:1e300", "key:1,key:1", Array(200).fill("key:1").join()]) {
        const answer = await fetch(`${farm.url}api/v1/jobs/${id}/light-mix?mix=${encodeURIComponent(mix)}`);
        assert.equal(answer.status, 400, mix);
        assert.match((await answer.json()).error, /^mix: /);
      }
    },

    async "without light groups nothing is mixed"() {
      const id = await farm.submit(join(root, "scenes/cornell-spheres.pbrt"), ...small, "--spp", "4", "--aov", "lightgroups", "--name", "no groups");
      const page = await open(`${farm.url}#/jobs/${id}`);
      await page.locator(".job-head .state", { hasText: "done" }).waitFor();
      await drawn(page);
      assert.equal(await page.locator(".light-mix:visible").count(), 0);
      await page.locator(".stage canvas").focus();
      await page.keyboard.press("m");
      assert.equal(await page.locator('.viewer-tools button[aria-pressed="true"]').count(), 0);
      await page.context().close();
    },

    async "a light mix follows the sliders, one question at a time"() {
      const asked = []; // the mixes, as they were asked for
      let under = 0;
      let most = 0;
      let ready = false;
      const made = await serveMadeUpFarm(dist, 100, 1, (request, response) => {
        const url = new URL(request.url, "http://x");
        if (url.pathname === "/api/v1/jobs/j50/image") return response.writeHead(200).end(picture(0.2)), true;
        if (url.pathname !== "/api/v1/jobs/j50/light-mix") return false;
        asked.push(`${url.searchParams.get("mix")}${url.searchParams.has("side") ? " small" : ""}`);
        most = Math.max(most, ++under);
        const had = asked.length;
        setTimeout(() => {
          under--;
          if (!ready) response.writeHead(204).end();
          else response.writeHead(200, { "X-Lightmill-Block": "2", ETag: `"${had}"` }).end(picture(0.9));
        }, 30);
        return true;
      });
      try {
        const page = await open(`${made.url}#/jobs/j50`);
        await drawn(page);
        const before = await middle(page);
        made.send("job", { id: "j50", full: true, detail: { settings: { light_groups: "key,rest" }, scene: "x", crop: [0, 0, 32, 18], cell_pixels: 32 } });
        const slider = page.getByRole("slider", { name: "rest: exposure in stops" });
        await slider.waitFor();
        // The lowest place is off. What was shown stays until there is a mix.
        await slider.focus();
        await page.keyboard.press("Home");
        assert.equal(await slider.getAttribute("aria-valuetext"), "off");
        await page.locator(".viewer-message", { hasText: "reading the light of the groups" }).waitFor();
        assert.equal(await page.evaluate(() => {
          const canvas = document.querySelector(".stage canvas");
          return [...canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data].join();
        }), before);
        ready = true;
        await page.locator(".viewer-note", { hasText: "in means over 2 × 2 pixels" }).waitFor();
        for (let i = 0; i < 30; i++) await page.keyboard.press("ArrowRight");
        const stops = Number(await slider.inputValue());
        const last = `rest:${Number((2 ** stops).toPrecision(4))}`;
        await until("the last mix, whole", () => asked.at(-1) === last);
        assert.equal(most, 1, "one question at a time");
        assert.ok(asked.includes("rest:0"), asked.join(" "));
        // A number that is none changes nothing.
        const number = page.getByRole("spinbutton", { name: "rest: factor" });
        await number.fill("-3");
        await page.getByRole("button", { name: "rest: as it was rendered" }).focus();
        assert.equal(await number.inputValue(), last.slice(5));
        await page.keyboard.press("Enter");
        await until("no change", () => asked.at(-1) === "");
        assert.equal(await page.locator(".mix-command").textContent(), "lightmill mix j50.exr -o j50-mix.exr");
        await page.context().close();
      } finally {
        made.close();
      }
    },
  };
}
