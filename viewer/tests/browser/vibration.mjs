// Vibration of a phone, whose motor is replaced by a list.

import { assert, assertNoConsoleErrors, pressFromAbove, screenshot, waitForRest, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

/** Page whose pulses are collected in `window.pulses`. */
async function pageWithMotor(browser, url, options) {
  const page = await browser.page("about:blank", options);
  await page.addInitScript(() => {
    window.pulses = [];
    Object.defineProperty(Navigator.prototype, "vibrate", { configurable: true, value: (length) => (window.pulses.push(length), true) });
  });
  await page.goto(url);
  return page;
}

/** Presses the object and holds it until it is felt. */
async function press(page) {
  await waitForScene(page);
  await waitForRest(page);
  await page.locator(".toolbar").getByText("Touch", { exact: true }).click({ force: true });
  await pressFromAbove(page, [30, -10], 3, 700);
}

const pulses = (page) => page.evaluate(() => window.pulses);

export const vibrationCases = [
  {
    name: "a phone vibrates at impacts, in short pulses, and the switch ends it",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const url = new URL(server.url);
      url.searchParams.set("ghost", "off");
      const page = await pageWithMotor(browser, url.href, { width: 360, height: 740, touch: true, scale: 2 });
      await press(page);
      const felt = await pulses(page);
      assert(felt.length >= 1 && felt.length <= 20, `pulses ${felt}`);
      assert(felt.every((length) => length >= 8 && length <= 40), `pulses ${felt}`);
      await page.click('[title="Controls"]');
      const control = page.getByLabel("Vibration");
      await control.scrollIntoViewIfNeeded();
      assert(await control.isChecked(), "it is off on a touch screen");
      await screenshot(page, "vibration-phone");
      await control.uncheck();
      await page.click('[title="Controls"]');
      await page.evaluate(() => (window.pulses.length = 0));
      await press(page);
      assert((await pulses(page)).length === 0, "it vibrates though it is off");
      await page.reload();
      await waitForScene(page);
      assert(!(await page.getByLabel("Vibration").isChecked()), "the choice is not kept");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "vibration is off at first on a desktop and with reduced motion, and on by its switch",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const url = new URL(server.url);
      url.searchParams.set("ghost", "off");
      for (const options of [{}, { width: 360, height: 740, touch: true, calm: true }]) {
        const page = await pageWithMotor(browser, url.href, options);
        await press(page);
        assert((await pulses(page)).length === 0, "it vibrates at first");
        if (options.touch) await page.click('[title="Controls"]');
        const control = page.getByLabel("Vibration");
        await control.check();
        assert((await pulses(page)).length === 1, "the switch is not felt");
        if (options.touch) await page.click('[title="Controls"]');
        else await screenshot(page, "vibration-desktop");
        await press(page);
        assert((await pulses(page)).length > 1, "it does not vibrate though it is on");
        assertNoConsoleErrors(page);
      }
    },
  },
  {
    name: "a device without a motor has no switch",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page("about:blank");
      await page.addInitScript(() => delete Navigator.prototype.vibrate);
      await page.goto(server.url);
      await waitForScene(page);
      assert((await page.getByLabel("Vibration").count()) === 0, "there is a switch");
      assertNoConsoleErrors(page);
    },
  },
];
