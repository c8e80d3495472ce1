// Turned phones, few Tabs, small windows with everything on.

import { assert, assertNoConsoleErrors, overlaps, screenshot, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const PARTS = [".header > *", ".toolbar > *", ".overlay-top > *", ".overlay-bottom > *"];

export const robustCases = [
  {
    name: "a phone that is turned shows all of it, in both positions",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { width: 390, height: 844, touch: true, scale: 2 });
      await waitForScene(page);
      for (const [name, width, height] of [
        ["landscape", 844, 390],
        ["portrait", 390, 844],
      ]) {
        await page.setViewportSize({ width, height });
        await page.waitForFunction(
          ([w, h]) => {
            const { canvas } = window.palpate.sceneView;
            return innerWidth === w && innerHeight === h && canvas.width === 2 * canvas.clientWidth && canvas.height === 2 * canvas.clientHeight;
          },
          [width, height],
        );
        const overlapping = await overlaps(page, PARTS);
        assert(overlapping.length === 0, `${name}: ${overlapping.join("; ")}`);
        const seen = await page.evaluate(() => {
          const { sceneView } = window.palpate;
          const [object] = sceneView.graphs[0].objects;
          const positions = object.surface.positions;
          const { clientWidth, clientHeight } = sceneView.canvas;
          for (let i = 0; i < positions.length; i += 3) {
            const at = sceneView.toPixels(object.group.localToWorld(sceneView.orbit.camera.position.clone().fromArray(positions, i)));
            if (at.x < 0 || at.y < 0 || at.x > clientWidth || at.y > clientHeight) return `a node is at ${at.x}, ${at.y} of ${clientWidth} × ${clientHeight}`;
          }
          return "";
        });
        assert(seen === "", `${name}: ${seen}`);
        await screenshot(page, `turned-${name}`);
      }
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "Tab reaches the scene with the sixth press at most, and Pause soon after",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const order = [];
      for (let i = 0; i < 14; i++) {
        await page.keyboard.press("Tab");
        order.push(await page.evaluate(() => (document.activeElement.tagName === "CANVAS" ? "scene" : (document.activeElement.getAttribute("aria-label") ?? document.activeElement.textContent.trim()))));
      }
      const at = order.indexOf("scene");
      assert(at >= 0 && at < 6, order.join(" | "));
      assert(order.indexOf("Pause (Space)") > at, order.join(" | "));
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a narrow window holds a slow scene with colours, its lock and the panels",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ pace: 0.4 }));
      const page = await browser.page(server.url, { width: 320, height: 568, touch: true, scale: 2, dark: true });
      await waitForScene(page);
      await page.keyboard.press("c");
      await page.waitForSelector(".scale-lock:not([hidden])");
      await page.waitForSelector(".chip.slow:not([hidden])", { timeout: 60_000 });
      const overlapping = await overlaps(page, [...PARTS, ".scale-lock"]);
      assert(overlapping.length === 0, overlapping.join("; "));
      const rows = await page.evaluate(() => document.querySelector(".header").getBoundingClientRect().height);
      assert(rows < 56, `the header is ${rows} px high`);
      await screenshot(page, "narrow-slow");
      await page.click('[title="Controls"]');
      await page.locator(".segmented >> text=Max. principal strain").scrollIntoViewIfNeeded();
      const wide = await page.evaluate(() => [...document.querySelectorAll("#controls *")].filter((e) => e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML.slice(0, 80)));
      assert(wide.length === 0, wide.join("\n"));
      await screenshot(page, "narrow-controls");
      assertNoConsoleErrors(page);
    },
  },
];
