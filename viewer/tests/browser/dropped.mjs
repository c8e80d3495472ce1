// Files that are dropped onto the page without a server: logs play and are compared, recordings become scenes, meshes are recorded, and bad
// files are told.

import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { isDeepStrictEqual } from "node:util";
import { crc32 } from "node:zlib";
import { assert, assertNoConsoleErrors, latestFrame, pausePlayback, screenshot, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const LOGS = fileURLToPath(new URL("../../../data/logs/", import.meta.url));
const SAMPLE = readFileSync(join(LOGS, "v3/finger_on_floor.mcap"));

/** Drops files onto the page: names with their bytes. */
export function drop(page, files) {
  const given = Object.entries(files).map(([name, bytes]) => [name, Buffer.from(bytes).toString("base64")]);
  return page.evaluate(async (list) => {
    const transfer = new DataTransfer();
    for (const [name, base64] of list) {
      const response = await fetch(`data:application/octet-stream;base64,${base64}`);
      transfer.items.add(new File([await response.arrayBuffer()], name));
    }
    window.dispatchEvent(new DragEvent("dragover", { dataTransfer: transfer, cancelable: true }));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true }));
  }, given);
}

/** Waits until logs are shown and computed. */
async function waitForLogs(page, count) {
  await page.waitForFunction((n) => document.documentElement.dataset.kind === "logs" && window.palpate?.sceneView.graphs.length === n && window.palpate.sceneView.graphs.every((graph) => graph.frame !== null), count, { timeout: 60_000 });
  await page.waitForFunction(() => document.querySelectorAll(".job").length === 0, null, { timeout: 60_000 });
}

/** Log whose scene names a recording that it does not carry: its attachment has another text, and the checksum of that. */
function renamedRecording() {
  const bytes = Buffer.from(SAMPLE.toString("latin1").replace('recording = "free.palp"', 'recording = "gone.palp"'), "latin1");
  const name = "finger_on_floor.toml";
  // Opcode, length; times of 8 bytes each, length of the name.
  const content = bytes.indexOf(name) - 4 - 16;
  const checksum = content + Number(bytes.readBigUInt64LE(content - 8)) - 4;
  bytes.writeUInt32LE(crc32(bytes.subarray(content, checksum)), checksum);
  return bytes;
}

/** Log of two seconds of the scene `pinch`, by the real program. */
function freshLog(name) {
  const folder = mkdtempSync(join(tmpdir(), "palpate-log-"));
  const path = join(folder, name);
  execFileSync(process.env.PALPATE, ["run", join(process.env.PAGE, "scenes/pinch/scene.toml"), "--realtime", "--duration", "2", "--log", path], { stdio: "pipe" });
  return path;
}

/** Answers of `palpate serve` about a log, once its last frame is computed. */
async function served(log, last, paths) {
  const child = spawn(process.env.PALPATE, ["serve", log, "--listen", "127.0.0.1:0", "--no-browser"], { stdio: ["ignore", "pipe", "pipe"] });
  try {
    let output = "";
    const url = await new Promise((found, failed) => {
      child.on("exit", () => failed(new Error(`palpate serve ended:\n${output}`)));
      for (const stream of [child.stdout, child.stderr]) {
        stream.on("data", (part) => {
          output += part;
          const address = output.match(/http:\/\/[^\s"']+/)?.[0];
          if (address !== undefined) found(address);
        });
      }
    });
    const answer = async (path) => Buffer.from(await (await fetch(new URL(path, url))).arrayBuffer());
    const end = Date.now() + 60_000;
    while ((await answer(`log/0/frames?from=${last}&count=1`)).length === 0) {
      assert(Date.now() < end, "palpate serve did not compute the log");
      await new Promise((wake) => setTimeout(wake, 100));
    }
    return await Promise.all(paths.map(answer));
  } finally {
    child.removeAllListeners("exit");
    child.kill("SIGINT");
  }
}

/** Second preset of the dialog, in which it comes up. */
const LIVER = { density: 1060 };

/** Drops a mesh onto the page, and has it recorded as the dialog proposes. */
async function record(page, name, bytes) {
  await drop(page, { [name]: bytes });
  await page.waitForSelector("dialog.upload-dialog[open]");
  await page.click("dialog.upload-dialog .primary");
}

/** Surface of a box as a binary STL: each face in so many squares a side. */
function boxSurface(size, cells) {
  const triangles = [];
  for (let axis = 0; axis < 3; axis++) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    for (const side of [0, 1]) {
      for (let i = 0; i < cells; i++) {
        for (let j = 0; j < cells; j++) {
          const corner = (a, b) => {
            const point = [0, 0, 0];
            [point[axis], point[u], point[v]] = [side * size[axis], ((i + a) / cells) * size[u], ((j + b) / cells) * size[v]];
            return point;
          };
          const square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
          if (side === 0) square.reverse();
          triangles.push([square[0], square[1], square[2]], [square[0], square[2], square[3]]);
        }
      }
    }
  }
  const bytes = Buffer.alloc(84 + 50 * triangles.length);
  bytes.writeUInt32LE(triangles.length, 80);
  triangles.forEach((points, at) => points.flat().forEach((number, k) => bytes.writeFloatLE(number, 84 + 50 * at + 12 + 4 * k)));
  return bytes;
}

function notificationOf(page, text) {
  return page.waitForFunction((part) => [...document.querySelectorAll(".notification span")].find((span) => span.textContent.includes(part))?.textContent, text, { timeout: 30_000 }).then((found) => found.jsonValue());
}

export const droppedCases = [
  {
    name: "a dropped log plays, seeks, and survives a reload, without a server",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await drop(page, { "finger_on_floor.mcap": SAMPLE });
      await waitForLogs(page, 1);
      assert((await page.textContent("h1.title")) === "finger_on_floor.mcap", "the title is not the log's name");
      await pausePlayback(page);
      await page.locator(".scrubber").fill("0.2");
      await page.waitForFunction(() => Math.abs(window.palpate.sceneView.graphs[0].frame?.time - 0.2) < 0.02);
      await page.click('[title="Measurements"]');
      await page.waitForTimeout(600);
      const [force] = await page.locator(".legend b").allTextContents();
      assert(/^[\d.]+\s*[mµ]?N$/.test(force), `the force plot shows ${force}`);
      await screenshot(page, "dropped-log");
      await page.reload();
      await waitForLogs(page, 1);
      await page.click("text=Back to the scenes");
      await page.waitForFunction(() => document.documentElement.dataset.kind === "live", null, { timeout: 60_000 });
      await waitForScene(page);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "two dropped logs are compared, the second beside the first",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const other = readFileSync(join(LOGS, "v3_relaxing/finger_on_floor.mcap"));
      for (const [name, options] of [
        ["desk", { width: 1280, height: 800 }],
        ["phone", { width: 360, height: 740, touch: true, scale: 2, dark: true }],
      ]) {
        const page = await browser.page(server.url, options);
        await waitForScene(page);
        await drop(page, { "one.mcap": SAMPLE });
        await waitForLogs(page, 1);
        await drop(page, { "two.mcap": other });
        await waitForLogs(page, 2);
        await pausePlayback(page);
        await page.locator(".scrubber").fill("0.2");
        await page.waitForFunction(() => window.palpate.sceneView.graphs.every((graph) => Math.abs(graph.frame?.time - 0.2) < 0.02));
        const captions = await page.locator(".captions span").allTextContents();
        assert(captions.join() === "one.mcap,two.mcap", `captions ${captions}`);
        await page.waitForTimeout(600);
        await screenshot(page, `dropped-logs-${name}`);
        await page.click('[title="Measurements"]');
        await page.waitForTimeout(600);
        await screenshot(page, `dropped-logs-${name}-curves`);
        assertNoConsoleErrors(page);
      }
    },
  },
  {
    name: "a dropped log of the real program has the frames of its server to the byte",
    serverlessOnly: true,
    async run(browser) {
      assert(process.env.PALPATE, "PALPATE is not the path of the program");
      const path = freshLog("pinch.mcap");
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await drop(page, { "pinch.mcap": readFileSync(path) });
      await waitForLogs(page, 1);
      const last = (await page.evaluate(() => window.palpate.sceneView.graphs[0].info.frames)) - 1;
      const paths = ["log/0/frames?from=0&count=60", `log/0/frames?from=60&count=${last - 59}`, "log/0/series", "scene/0/object/0/surface"];
      await page.waitForFunction(async (at) => (await window.palpate.connection.fetch(`log/0/frames?from=${at}&count=1`)).byteLength > 0, last, { polling: 200, timeout: 60_000 });
      const theirs = await served(path, last, paths);
      rmSync(dirname(path), { recursive: true });
      for (const [at, of] of paths.entries()) {
        const own = Buffer.from(await page.evaluate(async (asked) => [...new Uint8Array(await window.palpate.connection.fetch(asked))], of));
        // The order of keys is that of the build.
        const same = of.endsWith("series") ? isDeepStrictEqual(JSON.parse(own), JSON.parse(theirs[at])) : own.equals(theirs[at]);
        assert(own.length > 100 && same, `${of}: ${own.length} bytes here, ${theirs[at].length} of the server`);
      }
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "bad logs are told as the program tells them, and the scene goes on",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const withoutRecording = renamedRecording();
      const bad = [
        ["empty.mcap", Buffer.alloc(0), "empty.mcap: the log"],
        ["text.mcap", Buffer.from("no log at all"), "text.mcap: the log"],
        ["cut.mcap", SAMPLE.subarray(0, 300), "cut.mcap: the log"],
        ["zeros.mcap", Buffer.alloc(5000), "zeros.mcap: the log"],
        ["other.mcap", withoutRecording, "other.mcap: finger_on_floor.toml: line 9: cannot read the recording gone.palp"],
        ["notes.txt", Buffer.from("solid"), "notes.txt is not a supported mesh file"],
      ];
      for (const [name, bytes, text] of bad) {
        await drop(page, { [name]: bytes });
        const told = await notificationOf(page, text);
        if (process.env.SHOTS) browser.note(told);
        const { step } = await latestFrame(page);
        await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame.step > before, step);
      }
      await screenshot(page, "dropped-bad");
      assert((await page.getAttribute("html", "data-kind")) === "live", "the page left the scene");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a dropped surface is recorded in the page and falls, and its recording is saved for the program",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const { generation } = await latestFrame(page);
      await record(page, "box.stl", boxSurface([60, 40, 50], 4));
      await page.waitForSelector('.job [aria-label="Cancel: mesh"]');
      // The scene goes on meanwhile.
      const { step } = await latestFrame(page);
      await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame.step > before + 100, step);
      await screenshot(page, "recording-in-page");
      await page.waitForFunction(() => document.querySelector("h1.title").textContent === "box.stl", null, { timeout: 120_000 });
      await page.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame?.generation > before, generation);
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.contacts.length > 0, null, { timeout: 30_000 });
      const about = await page.evaluate(() => window.palpate.sceneView.graphs[0].info.about);
      assert(about.startsWith("Your own mesh. Press and drag it. Note: the surface was filled with"), about);
      await screenshot(page, "recorded-in-page");
      await page.locator('summary:has-text("Import a mesh")').click();
      const [download] = await Promise.all([page.waitForEvent("download"), page.click('button:has-text("Save box.palp")')]);
      const told = execFileSync(process.env.PALPATE, ["inspect", await download.path()], { encoding: "utf8" });
      // 60 × 40 × 50 mm, filled exactly.
      const [mass] = told.match(/(?<=mass +)[\d.]+/) ?? [];
      const expected = 0.06 * 0.04 * 0.05 * LIVER.density;
      assert(Math.abs(mass / expected - 1) < 1e-3, `mass ${mass} kg, expected ${expected}\n${told}`);
      // The scene stays in the list.
      await page.click(".scenes button >> nth=1");
      await page.waitForFunction(() => document.querySelector("h1.title").textContent !== "box.stl");
      await page.click('.scenes button:has-text("box.stl")');
      await page.waitForFunction(() => document.querySelector("h1.title").textContent === "box.stl");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "the recording of a dropped mesh is cancelled by its button, and bad meshes are told",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { width: 360, height: 740, touch: true });
      await waitForScene(page);
      const name = "scan_of_a_box_with_a_name_that_is_rather_long.stl";
      await drop(page, { [name]: boxSurface([60, 60, 60], 12) });
      await page.waitForSelector("dialog.upload-dialog[open]");
      const [width, room] = await page.evaluate(() => {
        const dialog = document.querySelector("dialog.upload-dialog");
        return [dialog.scrollWidth, dialog.clientWidth];
      });
      assert(width <= room, `the dialog is ${width} px wide, and shows ${room}`);
      await screenshot(page, "record-dialog-phone");
      await page.click("dialog.upload-dialog .primary");
      await page.click('.job [aria-label="Cancel: mesh"]');
      await notificationOf(page, "the recording was cancelled");
      await page.waitForSelector(".job", { state: "detached" });
      for (const [name, bytes, text] of [
        ["empty.stl", Buffer.alloc(0), "empty.stl was not recorded: "],
        ["noise.obj", Buffer.from("v 1 2 nan\nf 1 2 3\n"), "noise.obj was not recorded: "],
        ["open.stl", boxSurface([60, 60, 60], 2).subarray(0, 84), "open.stl was not recorded: "],
      ]) {
        await record(page, name, bytes);
        const told = await notificationOf(page, text);
        if (process.env.SHOTS) browser.note(told);
        await page.waitForSelector(".job", { state: "detached" });
      }
      assert((await page.textContent("h1.title")) !== name, "a cancelled recording opened");
      await latestFrame(page);
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a dropped recording becomes a scene of its own that stays in the list",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      const recording = readFileSync(join(process.env.PAGE, "scenes/ball/ball.palp"));
      await drop(page, { "mine.palp": recording });
      await page.waitForFunction(() => document.querySelector("h1.title").textContent === "mine.palp");
      await latestFrame(page);
      // The object falls onto the floor.
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.contacts.length > 0, null, { timeout: 30_000 });
      const errors = await page.locator(".notification.error").allTextContents();
      assert(errors.length === 0, `errors: ${errors}`);
      await screenshot(page, "dropped-recording");
      await page.click(".scenes button >> nth=1");
      await page.waitForFunction(() => document.querySelector("h1.title").textContent !== "mine.palp");
      await page.click('.scenes button:has-text("mine.palp")');
      await page.waitForFunction(() => document.querySelector("h1.title").textContent === "mine.palp");
      await drop(page, { "empty.palp": Buffer.alloc(0) });
      assert((await notificationOf(page, "empty.palp")) === "empty.palp: the file is empty", "the text of an empty recording");
      await drop(page, { "bad.palp": recording.subarray(0, 1000) });
      await notificationOf(page, "bad.palp: ");
      await latestFrame(page);
      assertNoConsoleErrors(page);
    },
  },
];
