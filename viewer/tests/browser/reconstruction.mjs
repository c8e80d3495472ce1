// GPU reconstruction against the vertex stream.

import { assert, waitForRest, waitForSameStep, waitForScene, assertNoConsoleErrors, pixelOf } from "./browser.mjs";
import { start } from "./servers.mjs";

export const reconstructionCases = [
  {
    name: "surfaces reconstructed on the GPU match the vertex stream",
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const url = new URL(server.url);
      const modal = await browser.page(url.href);
      await waitForScene(modal);
      url.searchParams.set("stream", "vertices");
      const plain = await browser.page(url.href);
      await waitForScene(plain);
      // Paused while a pointer presses, so that residual displacements are included.
      await waitForRest(modal);
      await modal.keyboard.press("g");
      const { x, y } = await pixelOf(modal);
      await modal.mouse.move(x, y);
      await modal.mouse.down();
      await modal.mouse.move(x - 25, y - 35, { steps: 3 });
      await modal.waitForFunction(() => window.palpate.sceneView.graphs[0].frame?.devices.some((d) => Math.hypot(...d.force) > 0.01));
      await modal.waitForTimeout(500);
      await modal.keyboard.press("Space");
      await modal.waitForSelector('[aria-label="Resume (Space)"]');
      await waitForSameStep(modal, plain);
      const read = (page) =>
        page.evaluate(() => {
          const { sceneView } = window.palpate;
          const object = sceneView.graphs[0].objects[0];
          object.reconstruct(sceneView.renderer);
          const { shape } = sceneView.graphs[0].frame.objects[0];
          const normals = object.useGpu ? object.gpu.readNormals(sceneView.renderer) : object.cpuNormals.image.data;
          return {
            onGpu: object.useGpu,
            step: sceneView.graphs[0].frame.step,
            positions: [...object.currentPositions(sceneView.renderer)],
            normals: [...normals.slice(0, 4 * object.splitMesh.vertices)],
            q: shape.format === "modal" ? shape.q.reduce((sum, x) => sum + Math.abs(x), 0) : 0,
            unit: shape.format === "modal" ? shape.residualUnit : 0,
            residuals: shape.format === "modal" ? shape.residualNodes.length : 0,
            radius: object.info.radius,
          };
        });
      const [a, b] = [await read(modal), await read(plain)];
      assert(a.onGpu && !b.onGpu, `on the GPU: ${a.onGpu}, ${b.onGpu}`);
      assert(a.step === b.step, `steps ${a.step} and ${b.step}`);
      const apart = a.positions.reduce((most, x, i) => Math.max(most, Math.abs(x - b.positions[i])), 0);
      // Half-float mode shapes (relative error 2⁻¹¹), residual quantisation, mode truncation (gpu_reconstruction.ts).
      const allowed = a.q * 2 ** -11 + 0.51 * a.unit + 1.01e-5 * a.radius;
      assert(apart <= allowed, `positions are ${apart} m apart, ${allowed} are allowed`);
      const turned = a.normals.reduce((most, x, i) => (i % 4 === 3 ? most : Math.max(most, Math.abs(x - b.normals[i]))), 0);
      assert(turned < 0.02, `normals are ${turned} apart`);
      const strained = a.normals.reduce((most, x, i) => (i % 4 === 3 ? Math.max(most, Math.abs(x - b.normals[i])) : most), 0);
      assert(strained < 0.01, `strains are ${strained} apart`);
      browser.note(`positions ${apart.toExponential(1)} m apart of ${allowed.toExponential(1)} allowed, ${a.residuals} residuals, normals ${turned.toExponential(1)}, strains ${strained.toExponential(1)}`);
      await modal.mouse.up();
      assertNoConsoleErrors(modal);
      assertNoConsoleErrors(plain);
    },
  },
];
