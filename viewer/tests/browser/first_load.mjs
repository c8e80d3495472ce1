// First downloads of the page without a server: their progress, and what to do when one fails.

import { assert, assertNoConsoleErrors, screenshot, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const MODULE = "/palpate.wasm";

/** Sends half of a file, and the rest when it is told to. */
function halves(of) {
  let go = () => undefined;
  const rest = new Promise((done) => (go = done));
  const pace = async (path, content, response) => {
    if (!path.endsWith(of)) return void response.end(content);
    response.write(content.subarray(0, content.length / 2));
    await rest;
    response.end(content.subarray(content.length / 2));
  };
  return { pace, go };
}

export const firstLoadCases = [
  {
    name: "the first downloads tell their bytes and share until the scene is there",
    serverlessOnly: true,
    async run(browser) {
      for (const [of, what, options] of [
        [MODULE, "the simulation", { width: 1280, height: 720 }],
        [".palp", "the first recording", { width: 360, height: 740, touch: true, scale: 2, dark: true }],
      ]) {
        const { pace, go } = halves(of);
        const server = browser.keep(await start({ pace }));
        const page = await browser.page(server.url, options);
        const text = await page.waitForFunction((name) => document.querySelector(".loading.first span")?.textContent.match(`${name}: ([\\d.]+).[kM]?B of ([\\d.]+).[kM]?B, 50.%$`)?.[0], what);
        await page.waitForTimeout(300);
        await screenshot(page, `first-load-${of.slice(1)}`);
        const value = await page.evaluate(() => document.querySelector(".loading.first progress").value);
        assert(Math.abs(value - 0.5) < 0.01, `the bar is at ${value} for ${await text.jsonValue()}`);
        go();
        await waitForScene(page);
        assert((await page.locator(".loading.first").count()) === 0, "the progress stays");
        assertNoConsoleErrors(page);
      }
    },
  },
  {
    name: "a first download that fails says what to do, and loads again",
    serverlessOnly: true,
    async run(browser) {
      for (const [name, fail] of [
        ["breaks", (content, response) => (response.write(content.subarray(0, 1000)), setTimeout(() => response.destroy(), 200))],
        ["short", (content, response) => response.end(content.subarray(0, 0))],
      ]) {
        let fails = true;
        const pace = (path, content, response) => {
          if (path === MODULE && fails) fail(content, response);
          else response.end(content);
        };
        const server = browser.keep(await start({ pace }));
        const page = await browser.page(server.url);
        await page.waitForSelector(".banner:not([hidden])");
        const told = await page.textContent(".banner span");
        assert(told.startsWith("The scene could not be loaded: ") && told.endsWith("Look at the connection, and load the page again."), told);
        assert(told.includes(MODULE), told);
        assert((await page.locator(".loading.first").count()) === 0, "the progress stays");
        await screenshot(page, `first-load-${name}`);
        fails = false;
        await page.click("text=Load again");
        await waitForScene(page);
      }
    },
  },
];
