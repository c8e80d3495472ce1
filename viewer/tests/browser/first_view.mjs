// First view: the ghost finger, the hint, and what both leave behind.

import { assert, assertNoConsoleErrors, latestFrame, pixelOf, recordSent, screenshot, waitForRest, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const anyPressed = () => window.palpate.sceneView.graphs[0]?.frame?.devices.some((d) => d.mode === "touch" && Math.hypot(...d.force) > 0.01);
const allFree = () => window.palpate.sceneView.graphs[0]?.frame?.devices.every((d) => d.mode === "inactive");

/** Number of presses that the page has sent since `recordSent`. */
const presses = (page) => page.evaluate(() => window.sent.filter(({ type }) => type === "press").length);

/** Steps of the scene from now on, of one that a busy machine may slow down. */
async function waitForSteps(page, count) {
  const { step, generation } = await latestFrame(page);
  await page.waitForFunction(([s, g]) => (window.palpate.sceneView.graphs[0].frame?.step ?? 0) > s || window.palpate.sceneView.graphs[0].frame?.generation > g, [step + count, generation], { timeout: 120_000 });
}

export const firstViewCases = [
  {
    name: "a ghost finger presses and lets go, again and again, until somebody presses",
    once: true,
    async run(browser) {
      const server = browser.keep(await start());
      for (const [name, options] of [
        ["desk", {}],
        ["phone-dark", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
      ]) {
        const page = await browser.page(server.url, { ...options, ghost: true });
        await recordSent(page);
        await waitForScene(page);
        for (let press = 0; press < 2; press++) {
          await page.waitForFunction(anyPressed, null, { timeout: 60_000 });
          if (press === 0) await screenshot(page, `ghost-${name}`);
          assert(!(await page.isVisible(".force-readout")), "its force is shown as that of the user's hand");
          assert(await page.isVisible(".hint"), "it dismisses the hint");
          await page.waitForFunction(allFree, null, { timeout: 60_000 });
        }
        // Beside the object: the view, and the ghost has ended for good.
        await page.mouse.click(...(await page.evaluate(() => [20, window.palpate.sceneView.canvas.getBoundingClientRect().top + 200])));
        await page.waitForFunction(allFree);
        const before = await presses(page);
        assert(before >= 2, `${before} presses are recorded`);
        await waitForSteps(page, 6000);
        assert((await presses(page)) === before, "it presses again");
        assertNoConsoleErrors(page);
        await page.context().close();
      }
    },
  },
  {
    name: "there is no ghost finger where less motion is wanted, nor while the scene is paused",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const calm = await browser.page(server.url, { ghost: true, calm: true });
      await recordSent(calm);
      await waitForScene(calm);
      await waitForSteps(calm, 6000);
      assert((await presses(calm)) === 0, "it presses in spite of reduced motion");
      await calm.context().close();

      const page = await browser.page(server.url, { ghost: true });
      await waitForScene(page);
      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Resume (Space)"]');
      const before = await page.evaluate(() => performance.now());
      await recordSent(page);
      await page.waitForFunction((t) => performance.now() > t + 4000, before);
      assert((await presses(page)) === 0, "it presses while the scene is paused");
      await page.keyboard.press("Space");
      await page.waitForFunction(anyPressed, null, { timeout: 60_000 });
      assert((await presses(page)) >= 1, "its press is not recorded");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a scene of the user's own is left alone",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      server.scene.message.id = null;
      const page = await browser.page(server.url, { ghost: true });
      await recordSent(page);
      await waitForScene(page);
      await waitForSteps(page, 6000);
      assert((await presses(page)) === 0, "the ghost finger presses");
      const { x, y } = await pixelOf(page, 0, 0.2);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.waitForFunction(anyPressed);
      await page.mouse.up();
      assert((await presses(page)) === 1, "a press is not recorded");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "the hint names what is special in one line, leads to the certificate, and stays closed",
    once: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { ghost: true });
      await waitForScene(page);
      const why = (await page.textContent(".hint p")).replaceAll("\u202f", " ");
      assert(/^Finite-element forces at 1 kHz, a press within [\d.]+ % of the full model \(certificate\)\.$/.test(why), why);
      await page.click(".hint summary");
      assert((await page.locator(".hint li").count()) >= 2, "no gestures on demand");
      await screenshot(page, "hint-open");
      await page.click(".hint .link");
      assert(await page.isVisible(".accuracy li"), "the certificate is not shown");
      await page.click('[aria-label="Hide this hint"]');
      for (const visit of ["closed", "reloaded"]) {
        assert(!(await page.isVisible(".hint")), `${visit}: the hint stays`);
        if (visit === "reloaded") break;
        await page.reload();
        await waitForScene(page);
      }
      // Whoever has closed it needs no ghost.
      const { generation } = await latestFrame(page);
      await page.keyboard.press("r");
      await page.waitForFunction((g) => window.palpate.sceneView.graphs[0].frame?.generation > g, generation);
      assert(!(await page.isVisible(".hint")), "the hint comes back with a reset");
      // A finger that presses while the object falls would miss it.
      await waitForRest(page);
      const { x, y } = await pixelOf(page, 0, 0.2);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.waitForFunction(anyPressed);
      await page.mouse.up();
      assertNoConsoleErrors(page);
    },
  },
];
