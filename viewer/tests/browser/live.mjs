// Live mode: loading, controls, reconnection, several viewers, hidden pages, window sizes, lost WebGL context.

import { assert, waitForScene, latestFrame, overlaps, assertNoConsoleErrors, screenshot } from "./browser.mjs";
import { start } from "./servers.mjs";

const PARTS = [".header > *", ".toolbar > *", ".overlay-top > *", ".overlay-bottom > *", ".scene-view", ".header", ".toolbar"];

/** Newest frame once the stream has stopped. */
async function waitForStop(page) {
  let before = -1;
  for (let i = 0; i < 8; i++) {
    await page.waitForTimeout(900);
    const now = await latestFrame(page);
    if (now.step === before) return now;
    before = now.step;
  }
  throw new Error("frames keep arriving");
}

export const liveCases = [
  {
    name: "loads and shows the hint without overlaps, at four window sizes, light and dark",
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      for (const [name, options] of [
        ["desk", { width: 1280, height: 720 }],
        ["desk-dark", { width: 1280, height: 720, dark: true }],
        ["phone", { width: 390, height: 844, touch: true, scale: 2 }],
        ["phone-dark", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
        ["narrow", { width: 320, height: 568, touch: true, scale: 2 }],
        ["large", { width: 2560, height: 1440 }],
        ["large-dark", { width: 2560, height: 1440, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await waitForScene(page);
        assert(await page.isVisible(".hint"), "the hint is missing");
        const overlapping = await overlaps(page, PARTS.slice(0, 4));
        assert(overlapping.length === 0, `${name}: ${overlapping.join("; ")}`);
        const scrolls = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
        assert(!scrolls, `${name}: the page is wider than its window`);
        const rows = await page.evaluate(() => new Set([...document.querySelectorAll(".toolbar > .button")].filter((button) => button.offsetParent !== null).map((button) => button.offsetTop)).size);
        assert(rows <= 1, `${name}: the toolbar has ${rows} rows`);
        await page.waitForTimeout(600);
        await screenshot(page, `live-${name}`);
        assertNoConsoleErrors(page);
        await page.context().close();
      }
    },
  },
  {
    name: "the warnings of a scene are shown on desk and phone until they are closed",
    standinOnly: true,
    async run(browser) {
      const warnings = [
        'the object "cube" begins 2.00 mm inside "floor": it is let out without velocity; move it by as much along (0.00, 1.00, 0.00)',
        'device "finger" touches with a patch of 1.00e-2 m, less than 3 mean edges of "cube"',
      ];
      const server = browser.keep(await start({ warnings }));
      for (const [name, options] of [
        ["desk", { width: 1280, height: 720 }],
        ["phone-dark", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await waitForScene(page);
        const lines = await page.locator(".warnings li").allTextContents();
        assert(JSON.stringify(lines) === JSON.stringify(warnings), `${name}: ${lines}`);
        const overlapping = await overlaps(page, PARTS.slice(0, 4));
        assert(overlapping.length === 0, `${name}: ${overlapping.join("; ")}`);
        await screenshot(page, `warnings-${name}`);
        await page.click('[aria-label="Close the warnings"]');
        assert(!(await page.isVisible(".warnings")), `${name}: the warnings stay`);
        assertNoConsoleErrors(page);
        await page.context().close();
      }
    },
  },
  {
    name: "help, scenes, pause, single step, slow motion and reset work by keys and buttons",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.keyboard.press("?");
      assert(await page.isVisible("dialog.help-dialog"), "the help does not open");
      await screenshot(page, "help");
      await page.keyboard.press("Escape");
      assert(!(await page.isVisible("dialog.help-dialog")), "the help stays open");

      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Resume (Space)"]');
      const paused = await waitForStop(page);
      await page.keyboard.press(".");
      await page.waitForFunction((step) => window.palpate.sceneView.graphs[0].frame?.step > step, paused.step);
      const once = await waitForStop(page);
      await page.keyboard.press(".");
      await page.waitForFunction((step) => window.palpate.sceneView.graphs[0].frame?.step > step, once.step);
      const { step } = await waitForStop(page);
      assert(step === once.step + 1, `one step went ${step - once.step}`);
      await page.keyboard.press("Space");
      await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame?.step > before + 5, step);
      await page.keyboard.press("[");
      await page.waitForFunction(() => document.querySelector(".toolbar select").value === "2");
      await page.keyboard.press("]");
      await page.waitForFunction(() => document.querySelector(".toolbar select").value === "1");

      // Space pauses, also after a click on another button; a press of the mouse leaves the focus on none.
      await page.click('[aria-label="Reset view (V)"]');
      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Resume (Space)"]');
      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Pause (Space)"]');

      const { generation } = await latestFrame(page);
      await page.keyboard.press("r");
      await page.waitForFunction((g) => window.palpate.sceneView.graphs[0].frame?.generation > g, generation);
      const scenes = page.locator(".scene");
      if ((await scenes.count()) > 1) {
        await scenes.nth(1).click();
        await page.waitForFunction((g) => window.palpate.sceneView.graphs[0].frame?.generation > g, generation + 1);
        assert((await scenes.nth(1).getAttribute("aria-current")) === "true", "the scene is not marked");
      }
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a lost connection is shown, and restored when the server is back",
    serverOnly: true,
    async run(browser) {
      const server = await start();
      const page = await browser.page(server.url);
      await waitForScene(page);
      await server.close();
      await page.waitForSelector(".banner:not([hidden])");
      await screenshot(page, "lost");
      const again = browser.keep(await start({ port: server.port }));
      await page.evaluate(() => {
        window.palpate.sceneView.graphs[0].frame = null;
      });
      await page.waitForSelector(".banner", { state: "hidden" });
      await waitForScene(page);
      const { step } = await latestFrame(page);
      await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame?.step > before, step);
      assert(again.url !== undefined, "no server");
    },
  },
  {
    name: "a page that stalled keeps its connection",
    once: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      // The status tells the page that this server is never silent.
      await page.waitForFunction(() => document.querySelector(".timing")?.textContent.includes("Lateness"));
      const kept = await page.evaluate(async () => {
        const { sceneView } = window.palpate;
        const [graph] = sceneView.graphs;
        const { step } = graph.frame;
        const end = performance.now() + 7000;
        while (performance.now() < end);
        await new Promise((done) => setTimeout(done, 1500));
        return sceneView.graphs[0] === graph && graph.frame.step > step;
      });
      assert(kept, "the page has connected again");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "two viewers see the same scene and the viewer count",
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const [one, two] = [await browser.page(server.url), await browser.page(server.url)];
      await waitForScene(one);
      await waitForScene(two);
      await one.waitForSelector("text=2 viewers");
      await two.waitForSelector("text=2 viewers");
      const a = await latestFrame(one);
      // The same scene, a little later.
      await two.waitForFunction((step) => window.palpate.sceneView.graphs[0].frame?.step >= step, a.step);
      assert((await latestFrame(two)).generation === a.generation, "another generation");
      assertNoConsoleErrors(one);
      assertNoConsoleErrors(two);
    },
  },
  {
    name: "a hidden page gets no frames until it is shown again",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const setHidden = (hidden) =>
        page.evaluate((value) => {
          Object.defineProperty(document, "hidden", { configurable: true, get: () => value });
          document.dispatchEvent(new Event("visibilitychange"));
        }, hidden);
      await setHidden(true);
      const { step } = await waitForStop(page);
      await setHidden(false);
      await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame?.step > before, step);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "the layout follows the window size",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      for (const [width, height] of [
        [900, 500],
        [600, 900],
        [1700, 800],
      ]) {
        await page.setViewportSize({ width, height });
        await page.waitForFunction(
          ([w, h]) => {
            const { canvas } = window.palpate.sceneView;
            return innerWidth === w && innerHeight === h && canvas.width === canvas.clientWidth && canvas.height === canvas.clientHeight;
          },
          [width, height],
        );
        await page.waitForTimeout(400);
        const overlapping = await overlaps(page, PARTS.slice(0, 4));
        assert(overlapping.length === 0, `${width}×${height}: ${overlapping.join("; ")}`);
        await screenshot(page, `window-${width}`);
      }
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "undecodable messages are dropped and reported once",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ garbage: true }));
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.waitForSelector(".notification.error");
      await page.waitForTimeout(2500);
      assert((await page.locator(".notification.error").count()) === 1, "reported more than once");
      const { step } = await latestFrame(page);
      await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame?.step > before + 50, step);
      await screenshot(page, "garbage");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a lost WebGL context is restored",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { pictures: true });
      await waitForScene(page);
      await page.evaluate(() => {
        window.contextLoss = window.palpate.sceneView.renderer.getContext().getExtension("WEBGL_lose_context");
        window.contextLoss.loseContext();
      });
      await page.waitForSelector(".banner:not([hidden])");
      await page.evaluate(() => window.contextLoss.restoreContext());
      await page.waitForSelector(".banner", { state: "hidden" });
      await waitForScene(page);
      await page.waitForTimeout(500);
      const colours = await page.evaluate(() => {
        const { sceneView } = window.palpate;
        sceneView.requestRender();
        sceneView.draw(performance.now() / 1000);
        const small = document.createElement("canvas");
        small.width = small.height = 32;
        const context = small.getContext("2d");
        context.drawImage(sceneView.canvas, 0, 0, 32, 32);
        const { data } = context.getImageData(0, 0, 32, 32);
        return new Set(Array.from({ length: 1024 }, (_, i) => data.slice(4 * i, 4 * i + 3).join())).size;
      });
      assert(colours > 20, `only ${colours} colours are drawn`);
      await screenshot(page, "restored");
    },
  },
  {
    name: "a dropped mesh is recorded, with a dialog before and progress after",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
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
      await page.waitForSelector("dialog.upload-dialog[open]");
      await screenshot(page, "drop");
      const { generation } = await latestFrame(page);
      await page.click("dialog.upload-dialog .primary");
      await page.waitForSelector(".job");
      await screenshot(page, "recording");
      await page.waitForFunction((g) => window.palpate.sceneView.graphs[0].frame?.generation > g, generation);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a recording is cancelled by its button",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const { generation } = await latestFrame(page);
      await page.evaluate(() => window.palpate.connection.send({ type: "set_material", object: 0, young: 1000, poisson: 0.3, density: 100 }));
      await page.click('.job [aria-label^="Cancel: "]');
      await page.waitForSelector("text=the recording was cancelled");
      await page.waitForSelector(".job", { state: "detached" });
      assert((await latestFrame(page)).generation === generation, "it was recorded");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "the token leaves the address bar, and the page reloads without it",
    realOnly: true,
    async run(browser) {
      const token = "a&b#c d%20+é, long";
      const server = browser.keep(await start({ token }));
      assert(server.url.endsWith("/?token=a%26b%23c+d%2520%2B%C3%A9%2C+long"), server.url);
      const page = await browser.page(server.url);
      for (const visit of ["first", "reloaded"]) {
        await waitForScene(page);
        const address = page.url();
        assert(!address.includes("token") && new URL(address).pathname === "/", `${visit}: ${address}`);
        assertNoConsoleErrors(page);
        if (visit === "first") await page.reload();
      }
      const kept = await page.evaluate(() => [sessionStorage.getItem("palpate.token"), localStorage.length, document.cookie]);
      assert(JSON.stringify(kept) === JSON.stringify([token, 0, ""]), `kept: ${JSON.stringify(kept)}`);
      // Another tab has no token, and gets no scene.
      const other = await browser.page(page.url());
      await other.waitForSelector(".banner:not([hidden])");
      assert(await other.evaluate(() => window.palpate.sceneView.graphs.length === 0), "a scene without a token");
    },
  },
  {
    name: "the content security policy blocks inline code and foreign connections, and nothing that the page does",
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.keyboard.press("?");
      await page.keyboard.press("Escape");
      await page.click('[title="Measurements"]').catch(() => undefined);
      for (const key of ["c", "c", "c", "a", "w", "t", "t", "v"]) await page.keyboard.press(key);
      for (const summary of await page.locator("summary").all()) if (await summary.isVisible()) await summary.click();
      await page.waitForTimeout(500);
      assertNoConsoleErrors(page);
      const expected = ["base-uri", "connect-src", "object-src", "script-src", "script-src-attr", "script-src-elem", "style-src-attr"];
      const blocked = await page.evaluate(async (kinds) => {
        const directives = new Set();
        document.addEventListener("securitypolicyviolation", (event) => directives.add(event.effectiveDirective));
        const script = document.createElement("script");
        script.textContent = "window.injected = true";
        document.body.append(script);
        const box = document.createElement("div");
        box.innerHTML = '<img src="data:image/png;base64,x" onerror="window.injected = true"><p style="color:red"></p><base href="https://other.example/"><object data="x"></object>';
        document.body.append(box);
        await fetch("https://other.example/").catch(() => undefined);
        // Later: what the browser's debugger calls may evaluate strings.
        setTimeout(() => (0, eval)("window.injected = true"), 0);
        // Violations are told as events, on a busy page late; what runs beside them runs by then.
        const deadline = performance.now() + 20_000;
        while (directives.size < kinds && performance.now() < deadline) await new Promise((wake) => setTimeout(wake, 50));
        await new Promise((wake) => setTimeout(wake, 300));
        return { injected: window.injected === true, directives: [...directives].sort(), base: document.baseURI === location.href };
      }, expected.length);
      assert(!blocked.injected && blocked.base, `code was injected: ${JSON.stringify(blocked)}`);
      assert(JSON.stringify(blocked.directives) === JSON.stringify(expected), `blocked: ${blocked.directives}`);
    },
  },
  {
    name: "two objects on each other have one number: the weight of the upper one",
    realOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ scene: "stack" }));
      const page = await browser.page(server.url);
      await waitForScene(page);
      // A label has two decimals.
      await page.waitForFunction(
        () => {
          const { labels, info } = window.palpate.sceneView.graphs[0];
          const weight = info.objects[1].mass * 9.81;
          const shown = labels.map(({ text }) => parseFloat(text));
          return shown.length === 2 && shown.some((force) => Math.abs(force - weight) < 0.005 + 0.005 * weight);
        },
        null,
        { timeout: 60_000 },
      );
      await screenshot(page, "stack");
      assertNoConsoleErrors(page);
    },
  },
];
