// A live page: loads, stays when the server goes, when others come, when nobody looks.

import { assert, loaded, newest, overlaps, quiet, shot } from "./browser.mjs";
import { start } from "./servers.mjs";

const PARTS = [".head > *", ".bar > *", ".upper > *", ".lower > *", ".stage", ".head", ".bar"];

/** The last picture: those that are under way still come, then no more. */
async function calm(page) {
  let before = -1;
  for (let i = 0; i < 8; i++) {
    await page.waitForTimeout(900);
    const now = await newest(page);
    if (now.step === before) return now;
    before = now.step;
  }
  throw new Error("pictures go on coming");
}

export const liveCases = [
  {
    name: "loads, says what to do, and nothing overlaps, at three sizes, light and dark",
    async run(browser) {
      const server = browser.keep(await start());
      for (const [name, options] of [
        ["desk", { width: 1280, height: 720 }],
        ["desk-dark", { width: 1280, height: 720, dark: true }],
        ["phone", { width: 390, height: 844, touch: true, scale: 2 }],
        ["phone-dark", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
        ["large", { width: 2560, height: 1440 }],
        ["large-dark", { width: 2560, height: 1440, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await loaded(page);
        assert(await page.isVisible(".hint"), "there is no hint");
        const lying = await overlaps(page, PARTS.slice(0, 4));
        assert(lying.length === 0, `${name}: ${lying.join("; ")}`);
        const scrolls = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
        assert(!scrolls, `${name}: the page is wider than its window`);
        await page.waitForTimeout(600);
        await shot(page, `live-${name}`);
        quiet(page);
        await page.context().close();
      }
    },
  },
  {
    name: "help, scenes, pause, step, slow motion and reset work by keys and buttons",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await loaded(page);
      await page.keyboard.press("?");
      assert(await page.isVisible("dialog.help"), "no help");
      await shot(page, "help");
      await page.keyboard.press("Escape");
      assert(!(await page.isVisible("dialog.help")), "help stays");

      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Go on (Space)"]');
      const paused = await calm(page);
      await page.keyboard.press(".");
      await page.waitForFunction((step) => window.palpate.stage.worlds[0].picture.step > step, paused.step);
      const once = await calm(page);
      await page.keyboard.press(".");
      await page.waitForFunction((step) => window.palpate.stage.worlds[0].picture.step > step, once.step);
      const { step } = await calm(page);
      assert(step === once.step + 1, `one step went ${step - once.step}`);
      await page.keyboard.press("Space");
      await page.keyboard.press("[");
      await page.waitForFunction((before) => window.palpate.stage.worlds[0].picture.step > before + 5, step);
      assert((await page.inputValue(".bar select")) === "2", "not slower");

      const { generation } = await newest(page);
      await page.keyboard.press("r");
      await page.waitForFunction((g) => window.palpate.stage.worlds[0].picture?.generation > g, generation);
      const scenes = page.locator(".scene");
      if ((await scenes.count()) > 1) {
        await scenes.nth(1).click();
        await page.waitForFunction((g) => window.palpate.stage.worlds[0].picture?.generation > g, generation + 1);
        assert((await scenes.nth(1).getAttribute("aria-current")) === "true", "the scene is not marked");
      }
      quiet(page);
    },
  },
  {
    name: "the server dies, the page says so, and goes on when it is back",
    async run(browser) {
      const server = await start();
      const page = await browser.page(server.url);
      await loaded(page);
      await server.close();
      await page.waitForSelector(".banner:not([hidden])");
      await shot(page, "lost");
      const again = browser.keep(await start({ port: server.port }));
      await page.evaluate(() => {
        window.palpate.stage.worlds[0].picture = null;
      });
      await page.waitForSelector(".banner", { state: "hidden" });
      await loaded(page);
      const { step } = await newest(page);
      await page.waitForFunction((before) => window.palpate.stage.worlds[0].picture.step > before, step);
      assert(again.url !== undefined, "no server");
    },
  },
  {
    name: "two viewers see the same, and know of one another",
    async run(browser) {
      const server = browser.keep(await start());
      const [one, two] = [await browser.page(server.url), await browser.page(server.url)];
      await loaded(one);
      await loaded(two);
      await one.waitForSelector("text=2 viewers");
      await two.waitForSelector("text=2 viewers");
      const a = await newest(one);
      // What the other one sees is the same scene, a little later.
      await two.waitForFunction((step) => window.palpate.stage.worlds[0].picture.step >= step, a.step);
      assert((await newest(two)).generation === a.generation, "another generation");
      quiet(one);
      quiet(two);
    },
  },
  {
    name: "a page that nobody looks at gets no pictures, and gets them again",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await loaded(page);
      const look = (hidden) =>
        page.evaluate((value) => {
          Object.defineProperty(document, "hidden", { configurable: true, get: () => value });
          document.dispatchEvent(new Event("visibilitychange"));
        }, hidden);
      await look(true);
      const { step } = await calm(page);
      await look(false);
      await page.waitForFunction((before) => window.palpate.stage.worlds[0].picture.step > before, step);
      quiet(page);
    },
  },
  {
    name: "follows the size of its window",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await loaded(page);
      for (const [width, height] of [
        [900, 500],
        [600, 900],
        [1700, 800],
      ]) {
        await page.setViewportSize({ width, height });
        await page.waitForFunction(
          ([w, h]) => {
            const { canvas } = window.palpate.stage;
            return innerWidth === w && innerHeight === h && canvas.width === canvas.clientWidth && canvas.height === canvas.clientHeight;
          },
          [width, height],
        );
        await page.waitForTimeout(400);
        const lying = await overlaps(page, PARTS.slice(0, 4));
        assert(lying.length === 0, `${width}×${height}: ${lying.join("; ")}`);
        await shot(page, `window-${width}`);
      }
      quiet(page);
    },
  },
  {
    name: "what cannot be read is dropped, and said once",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ garbage: true }));
      const page = await browser.page(server.url);
      await loaded(page);
      await page.waitForSelector(".note.error");
      await page.waitForTimeout(2500);
      assert((await page.locator(".note.error").count()) === 1, "said more than once");
      const { step } = await newest(page);
      await page.waitForFunction((before) => window.palpate.stage.worlds[0].picture.step > before + 50, step);
      await shot(page, "garbage");
      quiet(page);
    },
  },
  {
    name: "a graphics card that forgets everything is filled again",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await loaded(page);
      await page.evaluate(() => {
        window.loser = window.palpate.stage.renderer.getContext().getExtension("WEBGL_lose_context");
        window.loser.loseContext();
      });
      await page.waitForSelector(".banner:not([hidden])");
      await page.evaluate(() => window.loser.restoreContext());
      await page.waitForSelector(".banner", { state: "hidden" });
      await loaded(page);
      await page.waitForTimeout(500);
      const colours = await page.evaluate(() => {
        const { stage } = window.palpate;
        stage.redraw();
        stage.draw(performance.now() / 1000);
        const small = document.createElement("canvas");
        small.width = small.height = 32;
        const pen = small.getContext("2d");
        pen.drawImage(stage.canvas, 0, 0, 32, 32);
        const { data } = pen.getImageData(0, 0, 32, 32);
        return new Set(Array.from({ length: 1024 }, (_, i) => data.slice(4 * i, 4 * i + 3).join())).size;
      });
      assert(colours > 20, `only ${colours} colours are drawn`);
      await shot(page, "restored");
    },
  },
  {
    name: "a mesh that is dropped is recorded, with questions before and progress after",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await loaded(page);
      await page.evaluate(() => {
        const data = new DataTransfer();
        data.items.add(new File(["solid x"], "liver.msh"));
        window.dispatchEvent(new DragEvent("dragover", { dataTransfer: data }));
      });
      await page.evaluate(() => {
        const data = new DataTransfer();
        data.items.add(new File(["solid x"], "liver.msh"));
        window.dispatchEvent(new DragEvent("drop", { dataTransfer: data }));
      });
      await page.waitForSelector("dialog.drop[open]");
      await shot(page, "drop");
      const { generation } = await newest(page);
      await page.click("dialog.drop .primary");
      await page.waitForSelector(".job");
      await shot(page, "recording");
      await page.waitForFunction((g) => window.palpate.stage.worlds[0].picture?.generation > g, generation);
      quiet(page);
    },
  },
];
