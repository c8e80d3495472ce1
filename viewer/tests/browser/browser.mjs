// Chromium without a screen, and what the cases ask of a page.

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

export class Browser {
  static async open() {
    const made = new Browser();
    made.chromium = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: SWITCHES });
    made.contexts = [];
    made.closers = [];
    return made;
  }

  /** A page of its own; complaints of its console count as failures unless a case expects them. */
  async page(url, { width = 1280, height = 720, dark = false, touch = false, scale = 1 } = {}) {
    const context = await this.chromium.newContext({
      viewport: { width, height },
      colorScheme: dark ? "dark" : "light",
      hasTouch: touch,
      isMobile: touch,
      deviceScaleFactor: scale,
    });
    this.contexts.push(context);
    const page = await context.newPage();
    page.setDefaultTimeout(20_000);
    page.complaints = [];
    page.on("pageerror", (error) => page.complaints.push(error.stack));
    page.on("console", (message) => {
      if (message.type() === "error") page.complaints.push(message.text());
    });
    await page.goto(url);
    return page;
  }

  /** Closed after the case. */
  keep(server) {
    this.closers.push(() => server.close());
    return server;
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

export function quiet(page) {
  assert(page.complaints.length === 0, `the page complains:\n${page.complaints.join("\n")}`);
}

export async function shot(page, name) {
  if (process.env.SHOTS) await page.screenshot({ path: join(process.env.SHOTS, `${name}.png`) });
}

/** Waits until the newest picture is of a scene that is loaded. */
export async function loaded(page) {
  await page.waitForFunction(() => (window.palpate?.stage.worlds[0]?.picture ?? null) !== null, null, { timeout: 60_000 });
}

/** What the newest picture says. */
export function newest(page) {
  return page.evaluate(() => {
    const { picture } = window.palpate.stage.worlds[0];
    return {
      step: picture.step,
      time: picture.time,
      generation: picture.generation,
      devices: picture.devices.map(({ doing, force, position }) => ({ doing, position, force: Math.hypot(...force) })),
      contacts: picture.contacts.length,
      pose: [...picture.objects[0].pose],
    };
  });
}

/** Where on the page a point of the first object's body is that lies `up` and `right` of its middle, in its radii. */
export function whereIs(page, right = 0, up = 0) {
  return page.evaluate(
    ([r, u]) => {
      const { stage } = window.palpate;
      const object = stage.worlds[0].objects[0];
      const at = object.group.position.clone();
      const m = stage.orbit.camera.matrixWorld.elements;
      const radius = object.info.radius;
      for (const [k, axis] of ["x", "y", "z"].entries()) at[axis] += radius * (r * m[k] + u * m[4 + k]);
      const pixel = stage.toStage(at);
      const box = stage.canvas.getBoundingClientRect();
      return { x: box.left + pixel.x, y: box.top + pixel.y };
    },
    [right, up],
  );
}

/** The object has come to lie: nothing moves any more. */
export async function atRest(page, patience = 15_000) {
  const end = Date.now() + patience;
  let before = (await newest(page)).pose;
  while (Date.now() < end) {
    await page.waitForTimeout(300);
    const { pose } = await newest(page);
    if (Math.hypot(...pose.map((x, k) => x - before[k])) < 2e-4) return;
    before = pose;
  }
}

/** Whether any two of these overlap, and whether any sticks out of the window. */
export function overlaps(page, selectors) {
  return page.evaluate((names) => {
    const boxes = names
      .flatMap((name) => [...document.querySelectorAll(name)].map((element) => ({ name: `${name} "${element.textContent.trim().slice(0, 20)}"`, element, box: element.getBoundingClientRect() })))
      .filter(({ box }) => box.width > 0 && box.height > 0);
    const found = [];
    boxes.forEach(({ name, box, element }, i) => {
      if (box.left < -1 || box.right > innerWidth + 1) found.push(`${name} sticks out`);
      for (const other of boxes.slice(i + 1)) {
        if (element.contains(other.element) || other.element.contains(element)) continue;
        const apart = box.right <= other.box.left + 1 || other.box.right <= box.left + 1 || box.bottom <= other.box.top + 1 || other.box.bottom <= box.top + 1;
        if (!apart) found.push(`${name} and ${other.name}`);
      }
    });
    return found;
  }, selectors);
}
