// Log that the page without a server records: the real program repeats it, with the forces that the page has shown.

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { assert, assertNoConsoleErrors, latestFrame, pressFromAbove, screenshot, waitForRest, waitForScene } from "./browser.mjs";
import { drop } from "./dropped.mjs";
import { start } from "./servers.mjs";

/** Opens Share and clicks a button of its log. */
async function clickLog(page, text) {
  await page.click('[aria-label^="Share"]');
  await page.waitForSelector(".share-dialog[open]");
  await page.locator(".share-dialog").getByText(text, { exact: true }).click();
}

/** Collects the force on each device by step, from the frames that the page gets. */
function collectForces(page) {
  return page.evaluate(() => {
    window.forces = {};
    const { graphs } = window.palpate.sceneView;
    const generation = graphs[0].info.generation;
    const collect = () => {
      const { frame, info } = window.palpate.sceneView.graphs[0];
      if (frame !== null && info.generation > generation && frame.generation === info.generation) window.forces[frame.step] = frame.devices.map(({ force }) => [...force]);
      requestAnimationFrame(collect);
    };
    collect();
  });
}

/** Presses the object for a moment. */
async function press(page) {
  await latestFrame(page);
  await waitForRest(page);
  await pressFromAbove(page, [20, -5], 4, 500);
}

/** Steps of a log as `palpate replay` computes them, by the columns of its CSV. */
function replayed(log) {
  const csv = `${log}.csv`;
  const output = execFileSync(process.env.PALPATE, ["replay", log, "--csv", csv], { encoding: "utf8", stdio: "pipe" });
  const [head, ...rows] = readFileSync(csv, "utf8").trim().split("\n").map((line) => line.split(","));
  return { output, head, rows: rows.map((row) => row.map(Number)) };
}

/** Ends the log, and gives its path. */
async function savedLog(page, end) {
  const downloading = page.waitForEvent("download", { timeout: 60_000 });
  await end();
  const download = await downloading;
  const path = join(mkdtempSync(join(tmpdir(), "palpate-log-")), download.suggestedFilename());
  await download.saveAs(path);
  return path;
}

/** Compares the replay of a log with the forces that the page has shown; gives the number of steps. */
async function compare(page, log) {
  const { head, rows } = replayed(log);
  const shown = await page.evaluate(() => window.forces);
  const names = await page.evaluate(() => window.palpate.sceneView.graphs[0].info.devices.map(({ name }) => name));
  let compared = 0;
  let largest = 0;
  for (const [step, forces] of Object.entries(shown)) {
    const row = rows[step - 1];
    if (row === undefined) continue;
    forces.forEach((force, device) => {
      const own = ["fx", "fy", "fz"].map((axis) => row[head.indexOf(`${names[device]}.${axis}`)]);
      // Frames have single precision.
      assert(own.every((value, axis) => Math.fround(value) === force[axis]), `step ${step}: ${names[device]} has ${force} on the page, ${own} in the replay`);
      largest = Math.max(largest, Math.hypot(...own));
      compared += 1;
    });
  }
  assert(compared > 20 && largest > 0.02, `${compared} forces were compared, the largest is ${largest} N`);
  return rows.length;
}

export const recordedLogCases = [
  {
    name: "a log recorded from the page replays by the real program with the forces of the page",
    serverlessOnly: true,
    async run(browser) {
      assert(process.env.PALPATE, "PALPATE is not the path of the program");
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      // A changed material: its recording is none of the files.
      await page.evaluate(() => {
        const { young, poisson, density } = window.palpate.sceneView.graphs[0].info.objects[0].material;
        window.palpate.connection.send({ type: "set_material", object: 0, young: 1.5 * young, poisson, density });
      });
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].info.generation === 2 && window.palpate.sceneView.graphs[0].frame !== null);
      await waitForRest(page);
      assert(!(await page.isVisible(".warnings")), "pointers that nobody chose are warned of");
      await collectForces(page);
      await clickLog(page, "Record log");
      await page.waitForSelector(".scene-log:not([hidden])");
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].info.generation === 3);
      await press(page);
      await screenshot(page, "log-recording");
      const log = await savedLog(page, () => page.click(".scene-log >> text=Stop"));
      await compare(page, log);
      assert(/^palpate-bounce-\d{4}-\d\d-\d\d\.mcap$/.test(log.split("/").at(-1)), log);
      // The page plays its own log.
      await drop(page, { "own.mcap": readFileSync(log) });
      rmSync(dirname(log), { recursive: true });
      await page.waitForFunction(() => document.documentElement.dataset.kind === "logs" && window.palpate?.sceneView.graphs[0]?.frame, null, { timeout: 60_000 });
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "what restarts the scene ends its log, which is saved",
    serverlessOnly: true,
    async run(browser) {
      assert(process.env.PALPATE, "PALPATE is not the path of the program");
      const server = browser.keep(await start({ scene: "ball" }));
      const page = await browser.page(server.url, { width: 360, height: 740, touch: true, scale: 2, dark: true });
      await waitForScene(page);
      await page.click('[aria-label^="Share"]');
      await page.waitForSelector(".share-dialog[open]");
      await page.locator(".share-dialog").getByText("Record log", { exact: true }).scrollIntoViewIfNeeded();
      await screenshot(page, "log-share-phone");
      await page.locator(".share-dialog").getByText("Record log", { exact: true }).click();
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].info.generation === 2 && window.palpate.sceneView.graphs[0].frame?.time > 0.3);
      await screenshot(page, "log-recording-phone");
      const log = await savedLog(page, () => page.click('[aria-label^="Reset"]'));
      const { rows } = replayed(log);
      rmSync(dirname(log), { recursive: true });
      assert(rows.length >= 300, `${rows.length} steps`);
      assert(!(await page.isVisible(".scene-log")), "the box stays");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "with a server Share says how logs are recorded",
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.click('[aria-label^="Share"]');
      assert((await page.textContent(".share-dialog")).includes("palpate serve --log run.mcap"), "it does not say how");
      assertNoConsoleErrors(page);
    },
  },
];
