// VR with an emulated headset (iwer): the button, controllers and hands that touch, and the way back.

import { readFileSync } from "node:fs";
import { assert, assertNoConsoleErrors, screenshot, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const EMULATOR = readFileSync(new URL("../../node_modules/iwer/build/iwer.min.js", import.meta.url), "utf8");

async function pageWithHeadset(browser, server) {
  // A small window: the emulator draws into it, on the processor.
  const page = await browser.page("about:blank", { width: 720, height: 420 });
  await page.addInitScript({ content: `${EMULATOR}
    window.headset = new IWER.XRDevice(IWER.metaQuest3);
    window.headset.installRuntime({ forceInstall: true });` });
  const url = new URL(server.url);
  url.searchParams.set("ghost", "off");
  await page.goto(url.href);
  await waitForScene(page);
  return page;
}

/** Forces on the devices of the newest frame [N], upwards. */
const lifts = (page) => page.evaluate(() => window.palpate.sceneView.graphs[0].frame.devices.map(({ force }) => force[1]));

/** Place of the right tip beside its controller or hand, in the room [m]. */
function tipOffset(page, which) {
  return page.evaluate((kind) => {
    const { xr } = window.palpate.sceneView.renderer;
    const held = window.headset[kind].right;
    held.position.set(0.3, 1.5, -0.5);
    held.quaternion.set(0, 0, 0, 1);
    return new Promise((done) => {
      const read = (_, frame) => {
        const source = [...frame.session.inputSources].find(({ handedness }) => handedness === "right");
        const joint = source?.hand?.get("index-finger-tip");
        const pose = joint === undefined ? frame.getPose(source.targetRaySpace, xr.getReferenceSpace()) : frame.getJointPose(joint, xr.getReferenceSpace());
        const { x, y, z } = pose.transform.position;
        done([x - held.position.x, y - held.position.y, z - held.position.z]);
      };
      // The frame after the next has the new place.
      xr.getSession().requestAnimationFrame(() => xr.getSession().requestAnimationFrame(read));
    });
  }, which);
}

/** Moves the tip of a controller or hand down through the middle of the scene until it feels an upward force. */
async function pressDown(page, which) {
  const offset = await tipOffset(page, which);
  for (let y = 1.5; y > 1; y -= 0.03) {
    await page.evaluate(([kind, [dx, dy, dz], height]) => window.headset[kind].right.position.set(-dx, height - dy, -0.5 - dz), [which, offset, y]);
    // On a slow page, too, the headset's frame has the place, and a later frame of the scene its force.
    await page.evaluate(() => {
      const session = window.palpate.sceneView.renderer.xr.getSession();
      return new Promise((done) => session.requestAnimationFrame(() => session.requestAnimationFrame(done)));
    });
    const step = await page.evaluate(() => window.palpate.sceneView.graphs[0].frame.step);
    await page.waitForFunction((sent) => window.palpate.sceneView.graphs[0].frame.step > sent + 60, step);
    if (Math.max(...(await lifts(page))) > 0.02) return;
  }
  throw new Error(`no force is felt by ${which}: ${await lifts(page)}`);
}

export const vrCases = [
  {
    name: "a headset enters the scene, a controller and a hand touch the object, and the page comes back",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await pageWithHeadset(browser, server);
      await page.waitForSelector('button[title="Enter VR"]:not([hidden])');
      await page.evaluate(() => {
        // Eyes that look down at the scene.
        window.headset.quaternion.set(Math.sin(-0.3), 0, 0, Math.cos(-0.3));
        window.headset.controllers.left.position.set(-0.6, 1.4, 0);
      });
      await page.click('button[title="Enter VR"]');
      await page.waitForFunction(() => window.palpate.sceneView.renderer.xr.isPresenting);
      await pressDown(page, "controllers");
      await screenshot(page, "vr-controller");
      const seen = await page.evaluate(() => window.palpate.sceneView.graphs[0].frame.devices.filter(({ mode }) => mode === "touch").length);
      assert(seen === 2, `${seen} devices touch, not two controllers`);

      await page.evaluate(() => {
        for (const hand of ["left", "right"]) window.headset.hands[hand].position.set(hand === "left" ? -0.6 : 0.6, 1.5, 0.2);
        window.headset.primaryInputMode = "hand";
      });
      await page.waitForFunction(() => [...window.palpate.sceneView.renderer.xr.getSession().inputSources].every(({ hand }) => hand != null));
      await pressDown(page, "hands");
      await screenshot(page, "vr-hand");

      await page.evaluate(() => window.palpate.sceneView.renderer.xr.getSession().end());
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame.devices.every(({ mode }) => mode === "inactive"));
      await page.waitForSelector('button[title="Enter VR"]');
      const frames = () => page.evaluate(() => window.palpate.sceneView.graphs[0].frame.step);
      const before = await frames();
      await page.waitForFunction((step) => window.palpate.sceneView.graphs[0].frame.step > step, before);
      await screenshot(page, "vr-left");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "without a headset there is no VR button",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      assert((await page.locator('button[title="Enter VR"]:visible').count()) === 0, "there is a VR button");
      assertNoConsoleErrors(page);
    },
  },
];
