// A Haply Inverse3 on a page without a server, against a stand-in for its service.

import { WebSocketServer } from "ws";
import { assert, screenshot, waitForRest, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

/** Inverse Service with one device, at a port or a free one. */
class InverseService {
  cursor = [0, -0.15, 0.2];
  pressed = false;
  force = [Number.NaN, Number.NaN, Number.NaN];
  /** Command with the largest force upwards. */
  upward = [0, 0, 0];
  profiles = [];
  commands = 0;

  static async start(port = 0) {
    const service = new InverseService();
    service.server = new WebSocketServer({ host: "127.0.0.1", port });
    await new Promise((done) => service.server.once("listening", done));
    service.server.on("connection", (socket) => {
      socket.send(JSON.stringify(service.state(true)));
      socket.on("message", (data) => {
        service.receive(JSON.parse(String(data)));
        socket.send(JSON.stringify(service.state(false)));
      });
    });
    return service;
  }

  get address() {
    return `ws://127.0.0.1:${this.server.address().port}`;
  }

  state(whole) {
    const [x, y, z] = this.cursor;
    const device = { device_id: "049D", state: { cursor_position: { x, y, z } } };
    if (whole) device.config = { type: "inverse3", basis: { permutation: "XYZ" } };
    return { inverse3: [device], wireless_verse_grip: [{ device_id: "61548", state: { buttons: { a: this.pressed, b: false, c: false } } }] };
  }

  receive({ session, inverse3 }) {
    if (session !== undefined) this.profiles.push(session.configure.profile.name);
    const { x, y, z } = inverse3[0].commands.set_cursor_force.vector;
    this.force = [x, y, z];
    if (z > this.upward[2]) this.upward = this.force;
    this.commands += 1;
  }

  /** Moves the hand, in half a second. */
  async move(to) {
    const [from, steps] = [this.cursor, 50];
    for (let step = 1; step <= steps; step++) {
      this.cursor = from.map((value, axis) => value + ((to[axis] - value) * step) / steps);
      await wait(10);
    }
  }

  async press() {
    this.pressed = true;
    await wait(200);
    this.pressed = false;
  }

  stop() {
    for (const client of this.server.clients) client.terminate();
    return new Promise((done) => this.server.close(done));
  }
}

const wait = (milliseconds) => new Promise((wake) => setTimeout(wake, milliseconds));

async function until(holds, text, timeout = 20_000) {
  const end = Date.now() + timeout;
  while (!holds()) {
    assert(Date.now() < end, text());
    await wait(20);
  }
}

const touching = (page) => page.evaluate(() => window.palpate.sceneView.graphs[0].frame.devices.filter(({ mode }) => mode === "touch").length);

export const haplyCases = [
  {
    name: "an Inverse3 touches the scene, feels it after the press of its button, and lets go when its service or the page ends",
    // An update more than 20 ms late takes the force away, as it should: beside another case that is the rule on two cores.
    alone: true,
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      let service = await InverseService.start();
      const { port } = service.server.address();
      const url = new URL(server.url);
      url.searchParams.set("ghost", "off");
      const page = await browser.page(url.href);
      await waitForScene(page);
      await waitForRest(page);
      await page.locator('summary:has-text("Haptic device")').click();
      await page.getByLabel("Address of the Inverse Service").fill(service.address);
      await page.locator("section, details").getByRole("button", { name: "Connect", exact: true }).click();
      await page.waitForSelector("text=Inverse3 049D: press a button");
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame.devices.some(({ mode }) => mode === "touch"));
      assert(service.profiles.join() === "palpate:page", `profiles ${service.profiles}`);
      // The hand goes down, to the centre of the scene, without force.
      const [x, y, z] = service.cursor;
      await service.move([x, y, z - 0.1]);
      await wait(300);
      assert(service.force.every((part) => part === 0), `a force of ${service.force} N before a button was pressed`);
      await service.press();
      await page.waitForSelector("text=Inverse3 049D: the force is on");
      await until(() => service.upward[2] > 0.1, () => `no force upwards: ${service.upward}`);
      const [right, forward, up] = service.upward;
      assert(up > 5 * Math.hypot(right, forward) && Math.hypot(...service.upward) <= 1.5 + 1e-9, `${service.upward} N`);
      await screenshot(page, "haply");
      const before = service.commands;
      await until(() => service.commands > before + 50, () => "the updates have ended");
      // A scene that hangs leaves no force behind.
      const worker = page.workers().find((known) => known.url().includes("scene_worker"));
      const hang = worker.evaluate(() => {
        const end = performance.now() + 1500;
        while (performance.now() < end);
      });
      await wait(700);
      assert(service.force.every((part) => part === 0), `a force of ${service.force} N while the scene hangs`);
      await hang;
      const hung = service.commands;
      await until(() => service.commands > hung + 50, () => "the updates have ended with the hang");
      // A service that goes away is told, and comes back without force.
      await service.stop();
      await page.waitForSelector("text=Waiting: ");
      service = await InverseService.start(port);
      await page.waitForSelector("text=Inverse3 049D: press a button");
      await until(() => service.commands > 20, () => "no commands");
      assert(service.force.every((part) => part === 0), `a force of ${service.force} N after a loss`);
      // Another scene takes the device over.
      await page.click(".scenes button >> nth=1");
      await page.waitForFunction(() => document.querySelector(".scene[aria-current]")?.textContent.includes("Two hands"));
      await until(() => service.commands > 40, () => "no commands");
      await page.locator("section, details").getByRole("button", { name: "Disconnect" }).click();
      await until(() => service.server.clients.size === 0, () => "the connection is open");
      assert(service.force.every((part) => part === 0), `a last force of ${service.force} N`);
      await page.waitForFunction(() => window.palpate.sceneView.graphs[0].frame.devices.every(({ mode }) => mode !== "touch"));
      await service.stop();
    },
  },
  {
    name: "without an Inverse Service the page says what to start",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const service = await InverseService.start();
      const { address } = service;
      await service.stop();
      const page = await browser.page(server.url);
      await waitForScene(page);
      await page.locator('summary:has-text("Haptic device")').click();
      await page.getByLabel("Address of the Inverse Service").fill(address);
      await page.locator("section, details").getByRole("button", { name: "Connect", exact: true }).click();
      await page.waitForSelector(`text=Waiting: no Inverse Service answers at ${address}: start Haply Hub.`);
      assert((await touching(page)) === 0, "a device without a service touches");
    },
  },
];
