// The GPU's sum of modes against the plain stream of vertices.

import { assert, atRest, loaded, quiet, whereIs } from "./browser.mjs";
import { start } from "./servers.mjs";

export const shapeCases = [
  {
    name: "modes summed on the GPU are the vertices of the plain stream",
    async run(browser) {
      const server = browser.keep(await start());
      const url = new URL(server.url);
      const modal = await browser.page(url.href);
      await loaded(modal);
      url.searchParams.set("stream", "vertices");
      const plain = await browser.page(url.href);
      await loaded(plain);
      // A finger presses while time stands: dents are there too.
      await modal.waitForTimeout(700);
      await atRest(modal);
      await modal.keyboard.press("g");
      const { x, y } = await whereIs(modal);
      await modal.mouse.move(x, y);
      await modal.mouse.down();
      await modal.mouse.move(x - 25, y - 35, { steps: 3 });
      await modal.waitForFunction(() => window.palpate.stage.worlds[0].picture.devices.some((d) => Math.hypot(...d.force) > 0.01));
      await modal.waitForTimeout(500);
      await modal.keyboard.press("Space");
      await modal.waitForSelector('[aria-label="Go on (Space)"]');
      await modal.waitForTimeout(2500);
      const read = (page) =>
        page.evaluate(() => {
          const { stage } = window.palpate;
          const object = stage.worlds[0].objects[0];
          object.reconstruct(stage.renderer);
          const { shape } = stage.worlds[0].picture.objects[0];
          const normals = object.fromGpu ? object.gpu.readNormals(stage.renderer) : object.cpuNormals.image.data;
          return {
            onGpu: object.fromGpu,
            step: stage.worlds[0].picture.step,
            places: [...object.currentPlaces(stage.renderer)],
            normals: [...normals.slice(0, 4 * object.smooth.vertices)],
            q: shape.form === "modal" ? shape.q.reduce((sum, x) => sum + Math.abs(x), 0) : 0,
            unit: shape.form === "modal" ? shape.unit : 0,
            dents: shape.form === "modal" ? shape.nodes.length : 0,
            radius: object.info.radius,
          };
        });
      const [a, b] = [await read(modal), await read(plain)];
      assert(a.onGpu && !b.onGpu, `on the GPU: ${a.onGpu}, ${b.onGpu}`);
      assert(a.step === b.step, `steps ${a.step} and ${b.step}`);
      const apart = a.places.reduce((most, x, i) => Math.max(most, Math.abs(x - b.places[i])), 0);
      // Shapes are half floats (2⁻¹¹ of them), dents steps of the unit, the smallest modes are left out (passes.ts).
      const allowed = a.q * 2 ** -11 + 0.51 * a.unit + 1.01e-5 * a.radius;
      assert(apart <= allowed, `places are ${apart} m apart, ${allowed} are allowed`);
      const turned = a.normals.reduce((most, x, i) => (i % 4 === 3 ? most : Math.max(most, Math.abs(x - b.normals[i]))), 0);
      assert(turned < 0.02, `normals are ${turned} apart`);
      const strained = a.normals.reduce((most, x, i) => (i % 4 === 3 ? Math.max(most, Math.abs(x - b.normals[i])) : most), 0);
      assert(strained < 0.01, `strains are ${strained} apart`);
      console.log(`         places ${apart.toExponential(1)} m apart of ${allowed.toExponential(1)} allowed, ${a.dents} dents, normals ${turned.toExponential(1)}, strains ${strained.toExponential(1)}`);
      await modal.mouse.up();
      quiet(modal);
      quiet(plain);
    },
  },
];
