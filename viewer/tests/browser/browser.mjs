// Headless Chromium, and queries on a page.

import { join } from "node:path";
import { chromium } from "playwright-core";

const SWITCHES = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
];

/** Whether a surface was asked for and its scene has changed meanwhile: the page loads that of the new one. */
const isOfFormerScene = (message) => message.text().includes("404") && /\/scene\/\d+\/object\//.test(message.location().url);

/** Time that a busy processor may take to encode a film [ms]. */
export const ENCODED_MS = 90_000;

/** Time between pictures of a page that draws sparsely [ms]. */
const SPARSE_MS = 1000;

/**
 * Lets the page draw its scene once a second only. Without a graphics card a picture takes most of the processor; all else that the page does
 * in a picture's time goes on at its rate.
 */
function drawSparsely(between) {
  let palpate;
  Object.defineProperty(window, "palpate", {
    get: () => palpate,
    set: (value) => {
      palpate = value;
      const { sceneView } = value;
      let last = -Infinity;
      const sparsely = (draw) => (...given) => {
        const now = performance.now();
        if (now < last + between) return;
        last = now;
        draw.apply(sceneView, given);
      };
      sceneView.draw = sparsely(sceneView.draw);
      sceneView.drawImmersive = sparsely(sceneView.drawImmersive);
    },
  });
}

export class Browser {
  static async open() {
    const browser = new Browser();
    browser.chromium = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: SWITCHES });
    browser.contexts = [];
    browser.closers = [];
    browser.notes = [];
    return browser;
  }

  /**
   * Page in its own context; console errors are collected in `consoleErrors`. Without its ghost finger, which would touch the scene. It draws sparsely
   * unless the case looks at pictures (`pictures`), or screenshots are taken.
   */
  async page(url, { width = 1280, height = 720, dark = false, touch = false, scale = 1, ghost = false, calm = false, pictures = false } = {}) {
    const context = await this.chromium.newContext({
      viewport: { width, height },
      colorScheme: dark ? "dark" : "light",
      reducedMotion: calm ? "reduce" : "no-preference",
      hasTouch: touch,
      isMobile: touch,
      deviceScaleFactor: scale,
    });
    this.contexts.push(context);
    if (!pictures && !process.env.SHOTS) await context.addInitScript(drawSparsely, SPARSE_MS);
    const page = await context.newPage();
    page.setDefaultTimeout(20_000);
    page.consoleErrors = [];
    page.on("pageerror", (error) => page.consoleErrors.push(error.stack));
    page.on("console", (message) => {
      if (message.type() === "error" && !isOfFormerScene(message)) page.consoleErrors.push(message.text());
    });
    const address = new URL(url);
    if (!ghost) address.searchParams.set("ghost", "off");
    await page.goto(address.href);
    return page;
  }

  /** Closes the server after the test case. */
  keep(server) {
    this.closers.push(() => server.close());
    return server;
  }

  /** Tells something of a case, below its line. */
  note(text) {
    this.notes.push(`  ${text}`);
  }

  async clear() {
    for (const context of this.contexts.splice(0)) await context.close();
    for (const close of this.closers.splice(0)) await close();
  }

  close() {
    return this.chromium.close();
  }
}

export function assert(holds, text) {
  if (!holds) throw new Error(text);
}

export function assertNoConsoleErrors(page) {
  assert(page.consoleErrors.length === 0, `console errors:\n${page.consoleErrors.join("\n")}`);
}

export async function screenshot(page, name) {
  if (process.env.SHOTS) await page.screenshot({ path: join(process.env.SHOTS, `${name}.png`) });
}

/** Waits until the scene is loaded and a frame of it is shown. */
export async function waitForScene(page) {
  await latestFrame(page);
}

/** Pauses the playback of logs, which may have come to its end. */
export async function pausePlayback(page) {
  if (await page.isVisible('[aria-label="Pause (Space)"]')) await page.keyboard.press("Space");
  await page.waitForSelector('[aria-label="Play (Space)"]');
}

/** Collects the messages that the page sends from now on in `window.sent`. */
export function recordSent(page) {
  return page.evaluate(() => {
    const { send } = WebSocket.prototype;
    window.sent = [];
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (message, ...others) {
      if (message.kind === "message") window.sent.push(JSON.parse(message.text));
      return postMessage.call(this, message, ...others);
    };
    WebSocket.prototype.send = function (text) {
      window.sent.push(JSON.parse(text));
      return send.call(this, text);
    };
  });
}

/** Summary of the newest frame; waits for the first one of a scene that the page is loading (again). */
export async function latestFrame(page) {
  const summary = await page.waitForFunction(
    () => {
      const frame = window.palpate?.sceneView.graphs[0]?.frame ?? null;
      return (
        frame !== null && {
          step: frame.step,
          time: frame.time,
          generation: frame.generation,
          devices: frame.devices.map(({ mode, force, position }) => ({ mode, position, force: Math.hypot(...force) })),
          contacts: frame.contacts.length,
          pose: [...frame.objects[0].pose],
        }
      );
    },
    null,
    { polling: 50, timeout: 60_000 },
  );
  return summary.jsonValue();
}

/** Page position [px] of a point `right` and `up` of the first object's centre, in object radii. */
export function pixelOf(page, right = 0, up = 0) {
  return page.evaluate(
    ([r, u]) => {
      const { sceneView } = window.palpate;
      const object = sceneView.graphs[0].objects[0];
      const at = object.group.position.clone();
      const m = sceneView.orbit.camera.matrixWorld.elements;
      const radius = object.info.radius;
      for (const [k, axis] of ["x", "y", "z"].entries()) at[axis] += radius * (r * m[k] + u * m[4 + k]);
      const pixel = sceneView.toPixels(at);
      const box = sceneView.canvas.getBoundingClientRect();
      return { x: box.left + pixel.x, y: box.top + pixel.y };
    },
    [right, up],
  );
}

/** Waits until the object is at rest: it moves less than 0.2 mm between two frames at least 0.3 s of simulated time apart. */
export async function waitForRest(page, timeout = 30_000) {
  const end = Date.now() + timeout;
  let before = await latestFrame(page);
  let moved = Infinity;
  while (Date.now() < end) {
    await page.waitForTimeout(100);
    const now = await latestFrame(page);
    if (now.time < before.time + 0.3) continue;
    moved = Math.hypot(...now.pose.map((x, k) => x - before.pose[k]));
    if (moved < 2e-4) return;
    before = now;
  }
  throw new Error(`the object is not at rest after ${timeout / 1000} s: it moved by ${moved} between the last two poses`);
}

/** Presses the object from above, where it cannot move away, until it is felt, drags by pixels, and holds for a time [ms]. */
export async function pressFromAbove(page, [right, down], steps, holdMs) {
  await page.evaluate(() => window.palpate.sceneView.orbit.rotate(0, 0.7));
  const { x, y } = await pixelOf(page, 0, 0.35);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.some((device) => Math.hypot(...device.force) > 0.02));
  await page.mouse.move(x + right, y + down, { steps });
  await page.waitForTimeout(holdMs);
  await page.mouse.up();
}

/** Waits until paused pages show the same step. */
export async function waitForSameStep(...pages) {
  const steps = () => Promise.all(pages.map(async (page) => (await latestFrame(page)).step));
  const end = Date.now() + 20_000;
  let before = await steps();
  while (Date.now() < end) {
    await pages[0].waitForTimeout(500);
    const now = await steps();
    if (now.every((step) => step === now[0]) && now[0] === before[0]) return;
    before = now;
  }
  throw new Error(`the paused pages show steps ${before.join(", ")}`);
}

/** Elements that overlap or leave the window. */
export function overlaps(page, selectors) {
  return page.evaluate((names) => {
    const boxes = names
      .flatMap((name) => [...document.querySelectorAll(name)].map((element) => ({ name: `${name} "${element.textContent.trim().slice(0, 20)}"`, element, box: element.getBoundingClientRect() })))
      .filter(({ box }) => box.width > 0 && box.height > 0);
    const found = [];
    boxes.forEach(({ name, box, element }, i) => {
      if (box.left < -1 || box.right > innerWidth + 1) found.push(`${name} leaves the window`);
      for (const other of boxes.slice(i + 1)) {
        if (element.contains(other.element) || other.element.contains(element)) continue;
        const apart = box.right <= other.box.left + 1 || other.box.right <= box.left + 1 || box.bottom <= other.box.top + 1 || other.box.bottom <= box.top + 1;
        if (!apart) found.push(`${name} and ${other.name}`);
      }
    });
    return found;
  }, selectors);
}
