// Touching with mouse, touch screen and keyboard.

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { assert, waitForRest, waitForScene, latestFrame, assertNoConsoleErrors, screenshot, pixelOf } from "./browser.mjs";
import { start } from "./servers.mjs";

const touching = (page) => page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.some((d) => d.mode !== "inactive"));
const pressed = (page, least = 0.02) =>
  page.waitForFunction((f) => window.palpate.sceneView.graphs[0].frame?.devices.some((d) => Math.hypot(...d.force) > f), least);
const released = (page) => page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.every((d) => d.mode === "inactive"));

function currentShape(page) {
  return page.evaluate(() => {
    const { sceneView } = window.palpate;
    return [...sceneView.graphs[0].objects[0].currentPositions(sceneView.renderer)];
  });
}

const maxDifference = (a, b) => a.reduce((most, x, i) => Math.max(most, Math.abs(x - b[i])), 0);

export const touchCases = [
  {
    name: "a press on the object deforms it, shows the force, and releases",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      const before = await currentShape(page);
      // On the top: pressed against the floor it cannot move away.
      await page.evaluate(() => window.palpate.sceneView.orbit.rotate(0, 0.7));
      const { x, y } = await pixelOf(page, 0, 0.35);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await pressed(page, 0.05);
      for (let i = 0; i < 4; i++) {
        await page.mouse.wheel(0, -120);
        await page.waitForTimeout(80);
      }
      await page.waitForTimeout(300);
      const during = await currentShape(page);
      const moved = maxDifference(before, during);
      assert(moved > 5e-4, `the shape changes by ${moved} m only`);
      assert(/\d/.test(await page.textContent(".force-readout .number")), "no force is shown");
      assert(!(await page.isVisible(".hint")), "the hint stays");
      await screenshot(page, "touch");
      await page.keyboard.press("c");
      await page.waitForTimeout(500);
      await screenshot(page, "touch-strain");
      await page.keyboard.press("c");
      await page.waitForTimeout(400);
      await screenshot(page, "touch-plain");
      await page.click('[title="Measurements"]').catch(() => undefined);
      await page.mouse.up();
      await released(page);
      assert(!(await page.isVisible(".force-readout")), "the force readout stays");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "holding pulls the object along; a drag beside it rotates the view",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { dark: true });
      await waitForScene(page);
      await waitForRest(page);
      await page.keyboard.press("g");
      await page.click('[title="Measurements"]');
      const { x, y } = await pixelOf(page, 0, 0.2);
      const { pose } = await latestFrame(page);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await touching(page);
      await page.mouse.move(x + 40, y - 260, { steps: 12 });
      await page.waitForFunction((height) => window.palpate.sceneView.graphs[0].frame?.objects[0].pose[1] > height + 0.008, pose[1]);
      const held = await latestFrame(page);
      assert(held.devices.some((d) => d.mode === "held" && d.force > 0.05), `nothing is held: ${JSON.stringify(held.devices)}`);
      await page.waitForTimeout(500);
      await screenshot(page, "hold");
      await page.mouse.up();
      await released(page);

      const camera = () => page.evaluate(() => window.palpate.sceneView.orbit.camera.position.toArray());
      const from = await camera();
      await page.mouse.move(60, 130);
      await page.mouse.down();
      await page.mouse.move(160, 150, { steps: 4 });
      await page.mouse.up();
      // The view rotates, in one of the next pictures.
      await page.waitForFunction((from) => {
        const to = window.palpate.sceneView.orbit.camera.position.toArray();
        return Math.hypot(...from.map((v, k) => v - to[k])) > 0.02;
      }, from);
      assert((await latestFrame(page)).devices.every((d) => d.mode === "inactive"), "rotating the view touched something");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "mouse input is logged and replays bit for bit",
    realOnly: true,
    async run(browser) {
      const folder = mkdtempSync(join(tmpdir(), "palpate-"));
      const [log, csv] = [join(folder, "mouse.mcap"), join(folder, "steps.csv")];
      const server = await start({ log });
      let done = server.close;
      try {
        const page = await browser.page(server.url);
        await waitForScene(page);
        await waitForRest(page);
        const { x, y } = await pixelOf(page, 0, 0.2);
        await page.mouse.move(x, y);
        await page.mouse.down();
        await pressed(page);
        await page.mouse.move(x + 60, y, { steps: 8 });
        await page.waitForTimeout(500);
        await page.mouse.up();
        await released(page);
        assertNoConsoleErrors(page);
        done = async () => undefined;
        await server.close();
        const summary = JSON.parse(execFileSync(process.env.PALPATE, ["replay", log, "--csv", csv, "--json"]).toString());
        assert(summary.replayed.identical, JSON.stringify(summary));
        const [header, ...rows] = readFileSync(csv, "utf8").trim().split("\n").map((line) => line.split(","));
        const at = (row, part) => ["x", "y", "z"].map((axis) => Number(row[header.indexOf(`finger1.${part}${axis}`)]));
        const presses = rows.filter((row) => Math.hypot(...at(row, "f")) > 0.02);
        assert(presses.length > 100, `${presses.length} steps with force`);
        const [first, last] = [at(presses[0], ""), at(presses[presses.length - 1], "")];
        const travel = Math.hypot(...first.map((x, k) => x - last[k]));
        assert(travel > 0.005, `the pointer moves ${travel} m`);
      } finally {
        await done();
        rmSync(folder, { recursive: true });
      }
    },
  },
  {
    name: "two fingers on a touch screen pinch the object",
    once: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { width: 390, height: 844, touch: true, scale: 2 });
      await waitForScene(page);
      await waitForRest(page);
      const screen = await page.context().newCDPSession(page);
      const touch = (type, points) => screen.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(({ x, y }, id) => ({ x, y, id })) });
      const [a, b] = [await pixelOf(page, -0.35, 0), await pixelOf(page, 0.35, 0)];
      await touch("touchStart", [a]);
      await touch("touchStart", [a, b]);
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.filter((d) => d.mode !== "inactive").length === 2);
      for (let i = 1; i <= 8; i++) {
        await touch("touchMove", [
          { x: a.x + 3 * i, y: a.y },
          { x: b.x - 3 * i, y: b.y },
        ]);
        await page.waitForTimeout(60);
      }
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.filter((d) => Math.hypot(...d.force) > 0.02).length === 2);
      assert((await page.locator(".force-readout .number").count()) === 2, "not two force readouts");
      await screenshot(page, "pinch");
      await touch("touchEnd", []);
      await released(page);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a keyboard pointer moves, presses and releases",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await waitForRest(page);
      await page.keyboard.press("Tab");
      await page.focus("canvas[tabindex]");
      await page.keyboard.down("ArrowDown");
      await page.waitForTimeout(250);
      await page.keyboard.up("ArrowDown");
      await page.keyboard.press("Enter");
      await touching(page);
      await screenshot(page, "keyboard");
      await page.keyboard.press("Enter");
      await released(page);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "every control is reachable by Tab and has an accessible name",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const nameless = await page.evaluate(() =>
        [...document.querySelectorAll("button, input, select, summary, canvas[tabindex]")]
          .filter((e) => e.getClientRects().length > 0)
          .filter((e) => ((e.getAttribute("aria-label") ?? "") + e.textContent + (e.closest("label")?.textContent ?? "")).trim() === "")
          .map((e) => e.outerHTML.slice(0, 80)),
      );
      assert(nameless.length === 0, nameless.join("\n"));
      const seen = new Set();
      for (let i = 0; i < 60; i++) {
        await page.keyboard.press("Tab");
        seen.add(await page.evaluate(() => document.activeElement.getAttribute("aria-label") ?? document.activeElement.textContent.trim().slice(0, 30)));
      }
      for (const name of ["Help and shortcuts (?)", "Pause (Space)", "Reset (R)"]) assert(seen.has(name), `Tab does not reach ${name}: ${[...seen].join(" | ")}`);
      assertNoConsoleErrors(page);
    },
  },
];
