// Log mode, and images for `palpate render`.

import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { assert, waitForScene, latestFrame, assertNoConsoleErrors, pausePlayback, screenshot } from "./browser.mjs";
import { start } from "./servers.mjs";

const time = (page) => page.evaluate(() => window.palpate.sceneView.graphs[0].frame.time);

async function renderOnce(browser, request) {
  const server = await start({ kind: "render", render: request });
  const page = await browser.page(server.url, { pictures: true });
  await page.waitForSelector("html[data-render]", { timeout: 120_000 });
  const state = await page.getAttribute("html", "data-render");
  assertNoConsoleErrors(page);
  const { images } = server;
  await server.close();
  assert(state === "done", `rendering ${state}`);
  return images;
}

export const logCases = [
  {
    name: "a log plays, seeks and steps frame by frame",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ kind: "logs", logs: 1 }));
      const page = await browser.page(server.url);
      await waitForScene(page);
      const began = await time(page);
      await page.waitForFunction((t) => window.palpate.sceneView.graphs[0].frame?.time > t + 0.1, began);
      await pausePlayback(page);
      await page.locator(".scrubber").fill("2.4");
      await page.waitForFunction(() => Math.abs(window.palpate.sceneView.graphs[0].frame?.time - 2.4) < 0.02);
      await page.locator("canvas[tabindex]").focus();
      const { step } = await latestFrame(page);
      await page.keyboard.press("ArrowRight");
      await page.waitForFunction((s) => window.palpate.sceneView.graphs[0].frame?.step === s + 16, step);
      await page.keyboard.press("ArrowLeft");
      await page.keyboard.press("ArrowLeft");
      await page.waitForFunction((s) => window.palpate.sceneView.graphs[0].frame?.step === s - 16, step);
      await page.click('[title="Measurements"]');
      await page.waitForTimeout(500);
      await screenshot(page, "log");
      const [force] = await page.locator(".legend b").allTextContents();
      assert(/^[\d.]+\s*[mµ]?N$/.test(force), `the force plot shows ${force}`);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "two logs play side by side and share the timeline",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ kind: "logs", logs: 2 }));
      for (const [name, options] of [
        ["desk", { width: 1600, height: 900 }],
        ["phone", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await page.waitForFunction(() => window.palpate?.sceneView.graphs.length === 2 && window.palpate.sceneView.graphs.every((w) => w.frame !== null), null, { timeout: 60_000 });
        await pausePlayback(page);
        await page.locator(".scrubber").fill("1.6");
        await page.waitForFunction(() => window.palpate.sceneView.graphs.every((w) => Math.abs(w.frame?.time - 1.6) < 0.3));
        await page.waitForTimeout(500);
        const times = await page.evaluate(() => window.palpate.sceneView.graphs.map((w) => w.frame.time));
        assert(times[0] === times[1], `times ${times}`);
        const hidden = await page.evaluate(() => {
          const { sceneView } = window.palpate;
          const { x, y, height } = sceneView.legendAreaOf(0);
          const bar = { right: x + 190, top: y + height - 54, bottom: y + height };
          const [object] = sceneView.graphs[0].objects;
          const positions = object.currentPositions(sceneView.renderer);
          for (let i = 0; i < positions.length; i += 3) {
            const at = sceneView.toPixels(object.group.localToWorld(sceneView.orbit.camera.position.clone().fromArray(positions, i)));
            if (at.x < bar.right && at.y > bar.top && at.y < bar.bottom) return `the colour bar covers the object at ${at.x}, ${at.y}`;
          }
          return "";
        });
        assert(hidden === "", hidden);
        await screenshot(page, `logs-${name}`);
        assertNoConsoleErrors(page);
      }
    },
  },
  {
    name: "rendered images arrive in order and are reproducible to the byte",
    standinOnly: true,
    async run(browser) {
      const request = { frames: [0, 80, 81, 82, 110], width: 960, height: 540, camera: null, colour: "displacement", dark: false };
      const [one, two] = [await renderOnce(browser, request), await renderOnce(browser, request)];
      assert(one.length === request.frames.length, `${one.length} images`);
      one.forEach((image, i) => {
        assert(image.subarray(1, 4).toString() === "PNG", `image ${i} is no PNG`);
        assert(image.readUInt32BE(16) === request.width && image.readUInt32BE(20) === request.height, `size of image ${i}`);
        assert(image.equals(two[i]), `image ${i} has other bytes the second time`);
      });
      assert(new Set(one.map((image) => image.toString("base64"))).size === one.length, "frames have the same image");
      const camera = { from: [0.3, 0.3, 0.1], to: [0, 0.05, 0] };
      const [dark] = await renderOnce(browser, { ...request, frames: [90], camera, colour: "strain", dark: true });
      if (process.env.SHOTS) {
        one.forEach((image, i) => writeFileSync(join(process.env.SHOTS, `render-${i}.png`), image));
        writeFileSync(join(process.env.SHOTS, "render-dark.png"), dark);
      }
    },
  },
];
