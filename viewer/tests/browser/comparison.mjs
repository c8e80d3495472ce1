// Logs that are compared, and colour scales that stay.

import { assert, assertNoConsoleErrors, pausePlayback, screenshot, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const bothShown = (page) =>
  page.waitForFunction(() => window.palpate?.sceneView.graphs.length === 2 && window.palpate.sceneView.graphs.every((graph) => graph.frame !== null), null, { timeout: 60_000 });
const bothAt = (page, time) => page.waitForFunction((t) => window.palpate.sceneView.graphs.every((graph) => Math.abs(graph.frame.time - t) < 0.02), time);

export const comparisonCases = [
  {
    name: "two logs have their curves in one plot, with the difference, on one scale; a press in the plot seeks",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ kind: "logs", logs: 2 }));
      for (const [name, options] of [
        ["desk", { width: 1600, height: 900 }],
        ["dark", { width: 1600, height: 900, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await bothShown(page);
        await pausePlayback(page);
        const names = page.locator("#measurements details:first-of-type .legend .name");
        await names.nth(2).waitFor();
        assert(JSON.stringify(await names.allTextContents()) === JSON.stringify(["pressed.mcap", "pressed-wider.mcap", "Difference"]), `${await names.allTextContents()}`);
        assert(/^Largest difference: .+N at [\d.]+.s\.$/.test(await page.textContent("#measurements details:first-of-type p")), await page.textContent("#measurements details:first-of-type p"));
        // In the middle of the plot is the middle of the log.
        const plot = await page.locator("#measurements .u-over").first().boundingBox();
        await page.mouse.click(plot.x + plot.width / 2, plot.y + plot.height / 2);
        await bothAt(page, 1.99);
        await page.mouse.move(plot.x + plot.width / 2, plot.y + 20);
        await page.mouse.down();
        await page.mouse.move(plot.x + plot.width / 4, plot.y + 20, { steps: 5 });
        await page.mouse.up();
        await bothAt(page, 0.995);
        const scales = await page.evaluate(() => window.palpate.sceneView.graphs.map((graph) => [graph.forceRange.value, graph.maxArrowLength]));
        assert(JSON.stringify(scales[0]) === JSON.stringify(scales[1]), `scales ${JSON.stringify(scales)}`);
        const energies = page.locator("#measurements details:nth-of-type(2)");
        await energies.locator("select").selectOption("Elastic");
        await page.locator(".scrubber").fill("1.6");
        await bothAt(page, 1.6);
        await page.waitForFunction(() => /J$/.test(document.querySelector("#measurements details:nth-of-type(2) .legend b")?.textContent ?? ""));
        await screenshot(page, `comparison-${name}`);
        assertNoConsoleErrors(page);
        await page.context().close();
      }
    },
  },
  {
    name: "colour scales of logs are those of the whole log, the same in rendered images; unlocked they grow and stay",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ kind: "logs", logs: 2 }));
      const page = await browser.page(server.url, { pictures: true });
      await bothShown(page);
      await pausePlayback(page);
      await page.keyboard.press("c");
      const lock = '[aria-label="Lock the colour scale"]';
      const range = () => page.evaluate(() => window.palpate.sceneView.colourRange);
      const twoPictures = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
      const seek = async (time) => {
        await page.locator(".scrubber").fill(String(time));
        await bothAt(page, time);
        await twoPictures();
      };
      // All of the logs is measured.
      await page.waitForSelector(`${lock}[aria-pressed="true"]`, { timeout: 60_000 });
      const whole = await range();
      const force = await page.evaluate(() => window.palpate.sceneView.graphs[1].forceRange.value);
      for (const time of [0, 0.16, 1.6, 3.2]) {
        await seek(time);
        assert((await range()) === whole, `the scale goes from ${whole} to ${await range()}`);
      }
      await screenshot(page, "locked");

      await seek(0);
      await page.click(lock);
      // The cube has not moved yet.
      await page.waitForFunction(() => window.palpate.sceneView.colourRange < 5e-4);
      await seek(1.6);
      await page.waitForFunction(() => window.palpate.sceneView.colourRange > 2e-3);
      await seek(0);
      await page.waitForFunction(() => window.palpate.sceneView.colourRange > 2e-3);
      await page.click(lock);
      const locked = await range();
      await seek(0.16);
      assert((await range()) === locked, `the locked scale goes from ${locked} to ${await range()}`);
      assertNoConsoleErrors(page);
      await page.context().close();

      const single = browser.keep(await start({ kind: "logs", logs: 1 }));
      const alone = await browser.page(single.url, { pictures: true });
      await waitForScene(alone);
      await pausePlayback(alone);
      await alone.keyboard.press("c");
      await alone.waitForSelector(`${lock}[aria-pressed="true"]`, { timeout: 60_000 });
      const scales = (of) => of.evaluate(() => [window.palpate.sceneView.colourRange, window.palpate.sceneView.graphs[0].forceRange.value]);
      const shown = await scales(alone);
      await alone.context().close();
      const render = browser.keep(await start({ kind: "render", render: { frames: [2, 3], width: 640, height: 360, camera: null, colour: "displacement", dark: false } }));
      const drawn = await browser.page(render.url, { pictures: true });
      await drawn.waitForSelector('html[data-render="done"]', { timeout: 120_000 });
      assert(JSON.stringify(await scales(drawn)) === JSON.stringify(shown), `rendered ${await scales(drawn)}, shown ${shown}`);
      assert(whole >= shown[0] && force >= shown[1], `two logs: ${whole} m, ${force} N; one of them: ${shown}`);
    },
  },
];
