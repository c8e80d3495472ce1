// The examples in headless Chromium, from a plain file server: each runs, and its finger feels the block.
//   node tests/examples.mjs      SHOTS=folder saves screenshots

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const folder = fileURLToPath(new URL("..", import.meta.url));
const TYPES = { html: "text/html", js: "text/javascript", wasm: "application/wasm" };
const ELSEWHERE = {
  "/examples/block.palp": join(folder, "../../crates/palpate-testkit/recordings/free.palp"),
};

const LIBRARIES = { three: "../../viewer/node_modules/three/build", babylon: "node_modules/babylonjs" };

const server = createServer(async (request, response) => {
  const { pathname } = new URL(request.url, "http://localhost");
  const [, library, file] = pathname.match(/^\/examples\/(three|babylon)\/(.+)$/) ?? [];
  const path = library !== undefined ? join(folder, LIBRARIES[library], file) : (ELSEWHERE[pathname] ?? join(folder, pathname));
  try {
    const content = await readFile(path);
    response.writeHead(200, { "content-type": TYPES[pathname.split(".").at(-1)] ?? "application/octet-stream" }).end(content);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const base = `http://127.0.0.1:${server.address().port}/examples/`;
const switches = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: switches });
let failed = 0;

const feels = () => Number.parseFloat(document.querySelector("output").value) > 0.01;
const press = async (page, selector) => {
  const box = await page.locator(selector).boundingBox();
  // From above into the block.
  for (let at = 0; at <= 20; at++) {
    await page.mouse.move(box.x + box.width / 2, box.y + box.height * (0.2 + 0.028 * at));
    await page.waitForTimeout(30);
  }
};
const cases = {
  "canvas.html": (page) => press(page, "canvas"),
  "three.html": (page) => press(page, "canvas"),
  "babylon.html": (page) => press(page, "canvas"),
  "worker.html": (page) => page.locator("input").fill("1"),
};
// Also with frames as a slow machine has them: pointer events come together, and the page is behind the press.
const slowFrames = () => {
  window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 1500);
};
const runs = Object.entries(cases).flatMap(([name, touch]) => (name === "worker.html" ? [false] : [false, true]).map((slow) => ({ name, touch, slow })));
async function run({ name, touch, slow }) {
  const page = await browser.newPage();
  if (slow) await page.addInitScript(slowFrames);
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && !message.text().includes("404") && errors.push(message.text()));
  try {
    await page.goto(base + name);
    await page.waitForFunction(() => document.querySelector("output").value !== "0 N", null, { timeout: 60_000 });
    await touch(page);
    await page.waitForFunction(feels, null, { timeout: 60_000 });
    if (process.env.SHOTS) await page.screenshot({ path: join(process.env.SHOTS, `example-${name}.png`) });
    if (errors.length > 0) throw new Error(errors.join("\n"));
    console.log(`passed   ${name}${slow ? ", slow frames" : ""}: ${await page.locator("output").textContent()}`);
  } catch (error) {
    failed += 1;
    console.log(`FAILED   ${name}${slow ? ", slow frames" : ""}\n${error.stack ?? error}\n${errors.join("\n")}`);
  }
  await page.close();
}
// Slow frames are waits: beside those of the others.
await Promise.all([false, true].map(async (slow) => {
  for (const one of runs) if (one.slow === slow) await run(one);
}));
await browser.close();
server.close();
process.exit(failed === 0 ? 0 : 1);
