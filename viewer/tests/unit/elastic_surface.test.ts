import { expect, test } from "vitest";
import { splitAtCreases } from "../../src/rendering/elastic/split_mesh";
import { halfFloatTable } from "../../src/rendering/elastic/half_float";
import { packModeShapes, modeOffset, gridFor, shapeLayout, padTexels } from "../../src/rendering/elastic/texture_layout";
import { vertexNormals, nodalPositions, triangleStrain } from "../../src/rendering/elastic/cpu_reconstruction";
import { truncationThreshold } from "../../src/rendering/elastic/gpu_reconstruction";
import { decodeModeShapes, decodeSurface } from "../../src/protocol/surface";
// @ts-expect-error: the stand-in is plain JavaScript.
import { boxSurface, shapesBytes, surfaceBytes, toHalf, waves } from "../standin/box.mjs";

const CELLS = 4;
const box = boxSurface(0.1, CELLS) as { positions: Float32Array; indices: Uint32Array };
const bytes = (buffer: Uint8Array) => Uint8Array.from(buffer).buffer;
const surface = decodeSurface(bytes(surfaceBytes(box)));

test("half floats decode to numbers that encode to the same bits", () => {
  const table = halfFloatTable();
  expect([table[0x3c00], table[0xc000], table[0x7bff], table[1], table[0x8000]]).toEqual([1, -2, 65504, 2 ** -24, -0]);
  for (let half = 0; half < 0x7c00; half += 7) expect(toHalf(table[half])).toBe(half);
  // Half of the last place of numbers from ½ to 1.
  for (let x = -1; x <= 1; x += 0.0137) expect(Math.abs(table[toHalf(x)] - x)).toBeLessThanOrEqual(2 ** -12);
});

test("surfaces and shapes of wrong length, or with indices out of range, are refused", () => {
  expect(surface.nodes).toBe((CELLS + 1) ** 3 - (CELLS - 1) ** 3);
  expect(() => decodeSurface(bytes(surfaceBytes(box)).slice(0, -4))).toThrow("triangles in");
  const wrong = { positions: box.positions, indices: Uint32Array.of(0, 1, 5000) };
  expect(() => decodeSurface(bytes(surfaceBytes(wrong)))).toThrow("node 5000");
  const shapes = decodeModeShapes(bytes(shapesBytes(box, waves(5), 0.1)));
  expect([shapes.nodes, shapes.modes, shapes.halves.length]).toEqual([surface.nodes, 5, 15 * surface.nodes]);
  expect(() => decodeModeShapes(bytes(shapesBytes(box, waves(5), 0.1)).slice(0, -40))).toThrow("shapes of");
});

test("modes and nodes are packed as the layout says, also with few layers", () => {
  for (const limits of [
    { size: 2048, layers: 256 },
    { size: 64, layers: 3 },
  ]) {
    const [nodes, modes] = [50, 10];
    const layout = shapeLayout(nodes, modes, limits)!;
    const halves = Uint16Array.from({ length: 3 * nodes * modes }, (_, i) => i);
    const texels = packModeShapes(halves, nodes, modes, layout);
    const rows = layout.rows * layout.planes;
    for (let mode = 0; mode < modes; mode++) {
      const { layer, row } = modeOffset(mode, layout);
      for (let node = 0; node < nodes; node++) {
        const [x, y] = [node % layout.width, row + Math.floor(node / layout.width)];
        expect(texels[3 * ((layer * rows + y) * layout.width + x) + 1]).toBe(3 * (mode * nodes + node) + 1);
      }
    }
  }
});

test("100,000 nodes with 200 modes fit into the minimum limits of WebGL 2; larger meshes are refused", () => {
  const layout = shapeLayout(100_000, 200, { size: 2048, layers: 256 })!;
  expect(layout.width * layout.rows).toBeGreaterThanOrEqual(100_000);
  expect(layout.layers).toBe(200);
  expect(shapeLayout(100_000, 200, { size: 512, layers: 16 })).toBeNull();
  expect(() => gridFor(5_000_000, { size: 2048, layers: 256 })).toThrow("more than a texture");
  expect([...padTexels(Float32Array.of(1, 2, 3, 4, 5, 6), 3, 4, { width: 2, rows: 1 })]).toEqual([1, 2, 3, 0, 4, 5, 6, 0]);
});

test("a box has six smooth faces with sharp edges", () => {
  const splitMesh = splitAtCreases(surface);
  expect(splitMesh.vertices).toBe(6 * (CELLS + 1) ** 2);
  const normals = new Float32Array(4 * splitMesh.vertices);
  vertexNormals(surface, splitMesh, surface.positions, normals);
  for (let v = 0; v < splitMesh.vertices; v++) {
    const [x, y, z, strain] = normals.subarray(4 * v, 4 * v + 4);
    expect(Math.max(Math.abs(x), Math.abs(y), Math.abs(z))).toBeCloseTo(1, 6);
    // Outwards: the face that the normal names.
    const place = surface.positions.subarray(3 * splitMesh.node[v], 3 * splitMesh.node[v] + 3);
    expect(x * place[0] + y * place[1] + z * place[2]).toBeCloseTo(0.05, 6);
    expect(strain).toBe(0);
  }
  const euler = surface.nodes + surface.indices.length / 3 - 2;
  expect(splitMesh.edges.length / 2).toBe(euler);
});

test("without creases every node has one vertex", () => {
  expect(splitAtCreases(surface, Math.PI).vertices).toBe(surface.nodes);
});

test("nodal positions are the sum of rest, modal and residual displacement", () => {
  const list = waves(6);
  const shapes = decodeModeShapes(bytes(shapesBytes(box, list, 0.1)));
  const q = Float32Array.of(1e-3, 0, -2e-3, 0, 0, 5e-4);
  const shape = { format: "modal" as const, q, residualUnit: 1e-5, residualNodes: Uint32Array.of(3, 3), residuals: Int8Array.of(0, 0, 0, 100, -50, 25) };
  const positions = nodalPositions(surface, shapes, shape);
  const table = halfFloatTable();
  const expected = surface.positions[9] + [0, 2, 5].reduce((sum, k) => sum + q[k] * table[shapes.halves[3 * (k * surface.nodes + 3)]], 0);
  expect(positions[9]).toBeCloseTo(expected + 1e-3, 7);
});

test("triangle strain is the largest relative elongation", () => {
  const rest = [1, 0, 0, 0.3, 1, 0];
  const stretched = (x: number, y: number) => [x, 0, 0, 0.3 * x, y, 0];
  expect(triangleStrain(rest, stretched(1.1, 1))).toBeCloseTo(0.1, 10);
  expect(triangleStrain(rest, stretched(1, 0.7))).toBeCloseTo(0.3, 10);
  // Turned by 90°: no strain.
  expect(triangleStrain(rest, [0, 1, 0, -1, 0.3, 0])).toBeCloseTo(0, 10);
  expect(triangleStrain([1, 0, 0, 2, 0, 0], rest)).toBe(0);
});

test("truncated modes sum to less than the bound", () => {
  expect(truncationThreshold(Float32Array.of(0.5, -0.125, 0.25, 0), 0.2)).toBe(0.25);
  expect(truncationThreshold(Float32Array.of(0.25, -0.25), 0.3)).toBe(0.25);
  expect(truncationThreshold(Float32Array.of(1, 2), 5)).toBe(Infinity);
});
