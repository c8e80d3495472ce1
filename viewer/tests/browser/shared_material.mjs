// Materials in links, settings that another viewer has changed, and the direction of gravity that comes back.

import { assert, assertNoConsoleErrors, latestFrame, recordSent, screenshot, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const serverless = Boolean(process.env.PAGE);
/** A small object, whose recording takes seconds. */
const SCENE = serverless || process.env.PALPATE ? "ball" : "bounce";

const send = (page, message) => page.evaluate((m) => window.palpate.connection.send(m), message);
const info = (page) => page.evaluate(() => window.palpate.sceneView.graphs[0].info);

async function openScene(page, id) {
  await send(page, { type: "open_scene", scene: id });
  await page.waitForFunction((scene) => window.palpate.sceneView.graphs[0]?.info.id === scene, id);
  await waitForScene(page);
}

/** Link of the share dialog, which is closed again. */
async function linkOf(page) {
  await page.keyboard.press("s");
  const link = await page.inputValue('[aria-label="Link to this scene"]');
  await page.keyboard.press("Escape");
  return new URL(link);
}

const waitForMaterial = (page, young, density) =>
  page.waitForFunction(([e, rho]) => {
    const material = window.palpate.sceneView.graphs[0]?.info.objects[0].material;
    return material != null && Math.abs(material.young / e - 1) < 1e-6 && Math.abs(material.density / rho - 1) < 1e-6;
  }, [young, density], { timeout: 120_000 });

export const sharedMaterialCases = [
  {
    name: "share: a link brings a material, also from a page that came after another viewer's changes",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await openScene(page, SCENE);
      const { id, objects } = await info(page);
      const { poisson } = objects[0].material;
      assert((await linkOf(page)).search === `?scene=${id}`, "the link of a scene as it was opened holds more than its name");
      const { generation } = await latestFrame(page);
      await send(page, { type: "set_physics", gravity: [0, -3.25, 0] });
      await page.waitForFunction((g) => window.palpate.sceneView.graphs[0]?.frame?.generation > g, generation);
      await send(page, { type: "set_material", object: 0, young: 25000, poisson, density: 400 });
      await waitForMaterial(page, 25000, 400);
      // A viewer that comes now, where there is a server.
      const later = serverless ? page : await browser.page(server.url);
      await waitForScene(later);
      const link = await linkOf(later);
      assert(link.search === `?scene=${id}&gravity=3.25&material=${objects[0].name},25000,${poisson},400`, link.search);

      const second = browser.keep(await start());
      const url = new URL(second.url);
      url.search = link.search;
      const other = await browser.page(url.href);
      await waitForMaterial(other, 25000, 400);
      await waitForScene(other);
      assert(Math.abs((await info(other)).gravity[1] + 3.25) < 1e-9, "gravity is lost");
      assert((await linkOf(other)).search === link.search, "a page that was opened by a link makes another link");
      await screenshot(other, "share-material");
      // Reset brings the settings back that the scene was opened with, also for a viewer who came later.
      await recordSent(later);
      await later.keyboard.press("r");
      await later.waitForFunction(() => Math.abs((window.palpate.sceneView.graphs[0]?.info.gravity[1] ?? 0) + 9.81) < 1e-9);
      for (const one of [page, later, other]) assertNoConsoleErrors(one);
    },
  },
  {
    name: "gravity that is raised from 0 points into the floor of a scene with z upwards",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await openScene(page, "upright");
      await recordSent(page);
      const field = page.locator('#controls input[aria-label^="Gravity"]');
      await field.fill("2.5");
      await field.press("Enter");
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0]?.info.gravity[2] < -2.4);
      const [{ gravity }] = await page.evaluate(() => window.sent.filter(({ type }) => type === "set_physics"));
      assert(Math.hypot(gravity[0], gravity[1], gravity[2] + 2.5) < 1e-9, `gravity is ${gravity}`);
      const up = await page.evaluate(() => window.palpate.sceneView.orbit.up.toArray());
      assert(Math.hypot(up[0], up[1], up[2] - 1) < 1e-9, `the camera's up is ${up}`);
      await screenshot(page, "gravity-z-up");
      assertNoConsoleErrors(page);
    },
  },
];
