// Logs, and pictures for `palpate render`.

import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { assert, loaded, newest, quiet, shot } from "./browser.mjs";
import { start } from "./servers.mjs";

const time = (page) => page.evaluate(() => window.palpate.stage.worlds[0].picture.time);

async function renderOnce(browser, order) {
  const server = await start({ kind: "render", render: order });
  const page = await browser.page(server.url);
  await page.waitForSelector("html[data-render]", { timeout: 120_000 });
  const state = await page.getAttribute("html", "data-render");
  quiet(page);
  const { pictures } = server;
  await server.close();
  assert(state === "done", `rendering ${state}`);
  return pictures;
}

export const logCases = [
  {
    name: "a log plays, is scrubbed, and goes frame by frame",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ kind: "logs", logs: 1 }));
      const page = await browser.page(server.url);
      await loaded(page);
      const began = await time(page);
      await page.waitForFunction((t) => window.palpate.stage.worlds[0].picture.time > t + 0.1, began);
      await page.keyboard.press("Space");
      await page.locator(".scrubber").fill("2.4");
      await page.waitForFunction(() => Math.abs(window.palpate.stage.worlds[0].picture.time - 2.4) < 0.02);
      await page.locator("canvas[tabindex]").focus();
      const { step } = await newest(page);
      await page.keyboard.press("ArrowRight");
      await page.waitForFunction((s) => window.palpate.stage.worlds[0].picture.step === s + 16, step);
      await page.keyboard.press("ArrowLeft");
      await page.keyboard.press("ArrowLeft");
      await page.waitForFunction((s) => window.palpate.stage.worlds[0].picture.step === s - 16, step);
      await page.click('[title="Measured"]');
      await page.waitForTimeout(500);
      await shot(page, "log");
      quiet(page);
    },
  },
  {
    name: "two logs stand side by side and share the time line",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ kind: "logs", logs: 2 }));
      for (const [name, options] of [
        ["desk", { width: 1600, height: 900 }],
        ["phone", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await page.waitForFunction(() => window.palpate?.stage.worlds.length === 2 && window.palpate.stage.worlds.every((w) => w.picture !== null));
        await page.locator(".scrubber").fill("1.6");
        await page.waitForFunction(() => window.palpate.stage.worlds.every((w) => Math.abs(w.picture.time - 1.6) < 0.3));
        await page.waitForTimeout(500);
        const times = await page.evaluate(() => window.palpate.stage.worlds.map((w) => w.picture.time));
        assert(times[0] === times[1], `times ${times}`);
        const lies = await page.evaluate(() => {
          const { stage } = window.palpate;
          const { x, y, height } = stage.legendOf(0);
          const bar = { right: x + 190, top: y + height - 54, bottom: y + height };
          const [object] = stage.worlds[0].objects;
          const places = object.currentPlaces(stage.renderer);
          for (let i = 0; i < places.length; i += 3) {
            const at = stage.toStage(object.group.localToWorld(stage.orbit.camera.position.clone().fromArray(places, i)));
            if (at.x < bar.right && at.y > bar.top && at.y < bar.bottom) return `the object lies under the colour bar at ${at.x}, ${at.y}`;
          }
          return "";
        });
        assert(lies === "", lies);
        await shot(page, `logs-${name}`);
        quiet(page);
      }
    },
  },
  {
    name: "pictures for render come in order, and have the same bytes every time",
    standinOnly: true,
    async run(browser) {
      const order = { frames: [0, 80, 81, 82, 110], width: 960, height: 540, camera: null, colour: "displacement", dark: false };
      const [one, two] = [await renderOnce(browser, order), await renderOnce(browser, order)];
      assert(one.length === order.frames.length, `${one.length} pictures`);
      one.forEach((picture, i) => {
        assert(picture.subarray(1, 4).toString() === "PNG", `picture ${i} is no PNG`);
        assert(picture.readUInt32BE(16) === order.width && picture.readUInt32BE(20) === order.height, `size of picture ${i}`);
        assert(picture.equals(two[i]), `picture ${i} has other bytes the second time`);
      });
      assert(!one[0].equals(one[1]), "all pictures are the same");
      const camera = { from: [0.3, 0.3, 0.1], to: [0, 0.05, 0] };
      const [dark] = await renderOnce(browser, { ...order, frames: [90], camera, colour: "strain", dark: true });
      if (process.env.SHOTS) {
        one.forEach((picture, i) => writeFileSync(join(process.env.SHOTS, `render-${i}.png`), picture));
        writeFileSync(join(process.env.SHOTS, "render-dark.png"), dark);
      }
    },
  },
];
