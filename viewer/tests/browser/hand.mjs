// What a hand means: fingers follow surfaces, presses are not lost, thrown objects come back, Space pauses.

import { assert, assertNoConsoleErrors, latestFrame, pixelOf, recordSent, screenshot, waitForRest, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const touching = (page) => page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.some((d) => d.mode !== "inactive"));
const released = (page) => page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.every((d) => d.mode === "inactive"));

/** Newest position that the page has sent [m], once it is the same in several pictures. */
const settledTarget = (page) =>
  page
    .waitForFunction(
      () => {
        const last = window.sent.findLast((m) => m.type === "move" || m.type === "press");
        const target = JSON.stringify(last?.position ?? last?.pointers[0].position);
        window.same = target === window.target ? (window.same ?? 0) + 1 : 0;
        window.target = target;
        return window.same >= 8 && target;
      },
      null,
      { polling: 50 },
    )
    .then((found) => found.jsonValue())
    .then(JSON.parse);

export const handCases = [
  {
    name: "a poking finger presses against the surface and follows it at its depth",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      await page.evaluate(() => window.palpate.sceneView.orbit.rotate(0, 0.35));
      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Resume (Space)"]');
      await recordSent(page);
      const from = await pixelOf(page, -0.35, 0.4);
      const to = await pixelOf(page, 0.3, 0.3);
      await page.mouse.move(from.x, from.y);
      await page.mouse.down();
      const first = await settledTarget(page);
      await page.mouse.move(to.x, to.y, { steps: 15 });
      await page.waitForFunction((before) => {
        const last = window.sent.findLast((m) => m.type === "move");
        return last !== undefined && Math.hypot(...last.pointers[0].position.map((v, k) => v - before[k])) > 0.02;
      }, first);
      const second = await settledTarget(page);
      // Of the top face of the cube, which is level: 9 % of its radius deep, here and there.
      const { height, radius } = await page.evaluate(() => {
        const [object] = window.palpate.sceneView.graphs[0].objects;
        return { height: object.group.position.y + 0.05, radius: object.info.radius };
      });
      for (const [name, [, y]] of [["first", first], ["second", second]]) {
        const depth = height - y;
        assert(Math.abs(depth - 0.09 * radius) < 0.004, `${name}: ${depth} m deep`);
      }
      assert(Math.abs(first[1] - second[1]) < 5e-4, `the finger leaves the surface: ${first[1]} m, then ${second[1]} m`);
      assert(Math.hypot(first[0] - second[0], first[2] - second[2]) > 0.02, "the finger does not move");
      await page.mouse.up();
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a press while the scene is paused is shown, and acts when it goes on",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      await page.keyboard.press("Space");
      await page.waitForSelector('[aria-label="Resume (Space)"]');
      const { x, y } = await pixelOf(page, 0, 0.35);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.waitForSelector("text=the press acts when time goes on");
      await screenshot(page, "paused-press");
      await page.keyboard.press("Space");
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.some((d) => d.mode === "touch" && Math.hypot(...d.force) > 0.02));
      await page.mouse.up();
      await released(page);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a press outlives a reset, and one that comes before the scene waits for it",
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      await page.keyboard.press("g");
      const { x, y } = await pixelOf(page, 0, 0.2);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await touching(page);
      const { generation } = await latestFrame(page);
      await page.keyboard.press("r");
      await page.waitForFunction((g) => {
        const { frame } = window.palpate.sceneView.graphs[0];
        return frame !== null && frame.generation > g && frame.devices.some((d) => d.mode === "held");
      }, generation);
      await page.mouse.up();
      await released(page);

      // The surface comes late: what is pressed meanwhile is not lost.
      let go;
      const late = new Promise((done) => (go = done));
      await page.route("**/object/0/surface", async (route) => {
        await late;
        await route.continue();
      });
      const before = await latestFrame(page);
      const asked = page.waitForRequest("**/object/0/surface");
      await page.keyboard.press("r");
      await asked;
      // A place that the object covers at rest as well as where its fall begins.
      const at = await pixelOf(page, 0, 0.3);
      await page.mouse.move(at.x, at.y);
      await page.mouse.down();
      go();
      await page.waitForFunction((g) => {
        const { frame } = window.palpate.sceneView.graphs[0];
        return frame !== null && frame.generation > g && frame.devices.some((d) => d.mode === "held");
      }, before.generation);
      await page.mouse.up();
      await released(page);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a held patch is a disc that lies on the surface, a touching finger a ball",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      await page.evaluate(() => window.palpate.sceneView.orbit.rotate(0, 0.5));
      const { x, y } = await pixelOf(page, 0, 0.35);
      await page.mouse.move(x, y);
      for (const [mode, disc] of [
        ["touch", false],
        ["held", true],
      ]) {
        await page.mouse.down();
        // Of the top face: its axis is upright.
        await page.waitForFunction(
          ([wanted, lying]) => {
            const [graph] = window.palpate.sceneView.graphs;
            const i = graph.frame?.devices.findIndex((device) => device.mode === wanted) ?? -1;
            if (i < 0) return false;
            const marker = graph.markers[i];
            const { x: a, z: b } = marker.disc.quaternion;
            return marker.disc.visible === lying && marker.proxy.visible === !lying && (!lying || 1 - 2 * (a * a + b * b) > 0.9);
          },
          [mode, disc],
        );
        await page.mouse.up();
        await released(page);
        await page.keyboard.press("g");
      }
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "an object that was thrown away is followed, or brought back, and V shows it",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { pictures: true });
      await waitForScene(page);
      assert(await page.evaluate(() => window.palpate.sceneView.graphs[0].grid === null), "a second grid");
      await page.click("text=Weightless cube");
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame !== null && window.palpate.sceneView.graphs[0].info.id === "float");
      // Motions of a scene without ground are seen against a grid; a ground has its own.
      assert(await page.evaluate(() => window.palpate.sceneView.graphs[0].grid !== null), "there is no grid");
      const inView = () => {
        const { sceneView } = window.palpate;
        const { x, y } = sceneView.toPixels(sceneView.graphs[0].objects[0].group.position);
        const { clientWidth, clientHeight } = sceneView.canvas;
        return x > 0 && y > 0 && x < clientWidth && y < clientHeight;
      };
      server.scene.box.velocity = [0.8, 0.2, 0];
      await page.waitForSelector("text=Out of view: cube");
      await screenshot(page, "lost-object");
      await page.keyboard.press("v");
      await page.waitForFunction(inView);
      server.scene.box.velocity = [3, 0.5, 0];
      await page.waitForSelector("text=Out of view: cube");
      await page.click(".lost-objects >> text=Show");
      await page.waitForFunction(inView);
      // It flies on, and the camera with it.
      const { pose } = await latestFrame(page);
      await page.waitForFunction((x) => window.palpate.sceneView.graphs[0].frame?.objects[0].pose[0] > x + 1, pose[0]);
      assert(await page.evaluate(inView), "the camera does not follow");
      await page.waitForSelector("text=Far away: cube");
      await page.click(".lost-objects >> text=Bring back");
      await page.waitForSelector(".lost-objects", { state: "hidden" });
      await page.waitForFunction(() => Math.abs(window.palpate.sceneView.graphs[0].frame?.objects[0].pose[0]) < 0.05);
      assert(await page.evaluate(inView), "it is not in view");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "Reset goes back to the scene's own settings and view; a refused value is taken back",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const field = (name) => page.locator(`input[aria-label^="${name}"]`);
      const camera = () => page.evaluate(() => window.palpate.sceneView.orbit.camera.position.toArray());
      const home = await camera();
      const own = await field("Gravity").inputValue();
      await field("Gravity").fill("3");
      const { generation } = await latestFrame(page);
      await field("Gravity").press("Enter");
      await page.waitForFunction((g) => window.palpate.sceneView.graphs[0].frame?.generation > g, generation);
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].info.gravity[1] === -3);
      await page.evaluate(() => window.palpate.sceneView.orbit.rotate(0.8, 0.2));
      assert(Math.hypot(...(await camera()).map((v, k) => v - home[k])) > 0.01, "the view does not turn");
      await page.keyboard.press("r");
      await page.waitForFunction((gravity) => document.querySelector('input[aria-label^="Gravity"]').value === gravity, own);
      await page.waitForFunction(() => Math.abs(window.palpate.sceneView.graphs[0].info.gravity[1] + 9.81) < 1e-9);
      assert(Math.hypot(...(await camera()).map((v, k) => v - home[k])) < 1e-9, "the view is not that of the start");

      // Out of the range, in the field's own unit.
      const step = await field("Time step").inputValue();
      await field("Time step").fill("50");
      await field("Time step").press("Enter");
      const message = page.locator(".field-message:visible");
      assert((await message.textContent()).replaceAll("\u00a0", " ") === "Time step: from 0.2 to 10 ms, not 50.", await message.textContent());
      assert((await field("Time step").inputValue()) === step, "the value is not taken back");
      await screenshot(page, "refused");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "another material is recorded again by a server, and follows from the recording without one",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.click("#controls summary >> text=Material");
      const panel = page.locator("#controls details", { hasText: "Young's modulus" });
      const field = (name) => panel.getByLabel(name);
      const serverless = Boolean(process.env.PAGE);
      assert((await panel.locator(".button.wide").textContent()) === (serverless ? "Apply" : "Record again"), "the button");
      assert((await field("Poisson's ratio").isDisabled()) === serverless, "Poisson's ratio");
      await screenshot(page, "material");
      if (serverless) {
        const { generation } = await latestFrame(page);
        const ratio = await field("Poisson's ratio").inputValue();
        const young = 2 * Number(await field("Young's modulus").inputValue());
        await field("Young's modulus").fill(String(young));
        await panel.locator(".button.wide").click();
        await page.waitForFunction((g) => window.palpate.sceneView.graphs[0].frame?.generation > g, generation);
        const { material } = await page.evaluate(() => window.palpate.sceneView.graphs[0].info.objects[0]);
        assert(Math.abs(material.young / 1000 - young) < 1e-9 * young, `${material.young} Pa`);
        assert((await field("Poisson's ratio").inputValue()) === ratio, "Poisson's ratio has changed");
      }
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a setting that the server refuses is taken back, with its reason at the field",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const field = page.locator('input[aria-label^="Time step"]');
      await field.fill("2");
      await field.press("Enter");
      await page.waitForSelector(".field-message >> text=the stand-in has 0.001 s only");
      assert((await field.inputValue()) === "1", await field.inputValue());
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "Space pauses after a click on any control",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      let paused = false;
      for (const control of ["text=Contact points", ".toolbar .segmented label:nth-child(2)", "#controls summary >> text=Material", "text=Max. principal strain", '[aria-label="Lock the colour scale"]']) {
        await page.click(control);
        await page.waitForFunction(() => document.activeElement === document.body || document.activeElement.tagName === "CANVAS");
        await page.keyboard.press("Space");
        paused = !paused;
        await page.waitForSelector(`[aria-label="${paused ? "Resume" : "Pause"} (Space)"]`);
      }
      assert(await page.isChecked("text=Contact points"), "Space has undone the click");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a mesh that was dropped stays in the list of scenes",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.evaluate(() => {
        const data = new DataTransfer();
        data.items.add(new File(["solid x"], "liver.msh"));
        window.dispatchEvent(new DragEvent("drop", { dataTransfer: data }));
      });
      await page.click("dialog.upload-dialog .primary");
      const entry = page.locator('.scene:has-text("liver.msh")');
      await entry.waitFor();
      assert((await entry.getAttribute("aria-current")) === "true", "it is not marked");
      await page.click(".scene >> text=Among obstacles");
      await page.waitForFunction(() => document.querySelector(".scene[aria-current]")?.textContent.includes("Among obstacles"));
      await entry.click();
      await page.waitForFunction(() => document.querySelector(".scene[aria-current]")?.textContent.includes("liver.msh"));
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a scene that is slower than real time says so until it is paused",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ pace: 0.4 }));
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.waitForSelector(".chip.slow:not([hidden])", { timeout: 60_000 });
      const shown = await page.textContent(".chip.slow");
      assert(/^0\.[1-4]\d?× real time$/.test(shown), shown);
      await screenshot(page, "slow");
      await page.keyboard.press("Space");
      await page.waitForSelector(".chip.slow", { state: "hidden" });
      assertNoConsoleErrors(page);
    },
  },
];
