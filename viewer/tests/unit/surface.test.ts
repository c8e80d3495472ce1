import { expect, test } from "vitest";
import { smoothParts } from "../../src/picture/elastic/creases";
import { halfTable } from "../../src/picture/elastic/half";
import { layShapes, modeAt, planeFor, shapeLayout, spread } from "../../src/picture/elastic/layout";
import { normalsOf, placesOf, triangleStrain } from "../../src/picture/elastic/reconstruct";
import { leastUsed } from "../../src/picture/elastic/passes";
import { readShapes, readSurface } from "../../src/protocol/surface";
// @ts-expect-error: the stand-in is plain JavaScript.
import { boxSurface, shapesBytes, surfaceBytes, toHalf, waves } from "../standin/box.mjs";

const CELLS = 4;
const box = boxSurface(0.1, CELLS) as { positions: Float32Array; corners: Uint32Array };
const bytes = (buffer: Uint8Array) => Uint8Array.from(buffer).buffer;
const surface = readSurface(bytes(surfaceBytes(box)));

test("half floats are numbers, and back again", () => {
  const table = halfTable();
  expect([table[0x3c00], table[0xc000], table[0x7bff], table[1], table[0x8000]]).toEqual([1, -2, 65504, 2 ** -24, -0]);
  for (let half = 0; half < 0x7c00; half += 7) expect(toHalf(table[half])).toBe(half);
  // Half of the last place of numbers from ½ to 1.
  for (let x = -1; x <= 1; x += 0.0137) expect(Math.abs(table[toHalf(x)] - x)).toBeLessThanOrEqual(2 ** -12);
});

test("surfaces and shapes with a wrong length, or with corners that are not there, are refused", () => {
  expect(surface.nodes).toBe((CELLS + 1) ** 3 - (CELLS - 1) ** 3);
  expect(() => readSurface(bytes(surfaceBytes(box)).slice(0, -4))).toThrow("triangles in");
  const wrong = { positions: box.positions, corners: Uint32Array.of(0, 1, 5000) };
  expect(() => readSurface(bytes(surfaceBytes(wrong)))).toThrow("node 5000");
  const shapes = readShapes(bytes(shapesBytes(box, waves(5), 0.1)));
  expect([shapes.nodes, shapes.modes, shapes.halves.length]).toEqual([surface.nodes, 5, 15 * surface.nodes]);
  expect(() => readShapes(bytes(shapesBytes(box, waves(5), 0.1)).slice(0, -40))).toThrow("shapes of");
});

test("modes and nodes lie where their layout says, also on machines with few layers", () => {
  for (const limits of [
    { size: 2048, layers: 256 },
    { size: 64, layers: 3 },
  ]) {
    const [nodes, modes] = [50, 10];
    const layout = shapeLayout(nodes, modes, limits)!;
    const halves = Uint16Array.from({ length: 3 * nodes * modes }, (_, i) => i);
    const texels = layShapes(halves, nodes, modes, layout);
    const rows = layout.rows * layout.planes;
    for (let mode = 0; mode < modes; mode++) {
      const { layer, row } = modeAt(mode, layout);
      for (let node = 0; node < nodes; node++) {
        const [x, y] = [node % layout.width, row + Math.floor(node / layout.width)];
        expect(texels[3 * ((layer * rows + y) * layout.width + x) + 1]).toBe(3 * (mode * nodes + node) + 1);
      }
    }
  }
});

test("100,000 nodes with 200 modes fit into the least that WebGL 2 promises; what cannot fit is said", () => {
  const layout = shapeLayout(100_000, 200, { size: 2048, layers: 256 })!;
  expect(layout.width * layout.rows).toBeGreaterThanOrEqual(100_000);
  expect(layout.layers).toBe(200);
  expect(shapeLayout(100_000, 200, { size: 512, layers: 16 })).toBeNull();
  expect(() => planeFor(5_000_000, { size: 2048, layers: 256 })).toThrow("more than a texture");
  expect([...spread(Float32Array.of(1, 2, 3, 4, 5, 6), 3, 4, { width: 2, rows: 1 })]).toEqual([1, 2, 3, 0, 4, 5, 6, 0]);
});

test("a box has six smooth faces, and its edges are sharp", () => {
  const smooth = smoothParts(surface);
  expect(smooth.vertices).toBe(6 * (CELLS + 1) ** 2);
  const normals = new Float32Array(4 * smooth.vertices);
  normalsOf(surface, smooth, surface.positions, normals);
  for (let v = 0; v < smooth.vertices; v++) {
    const [x, y, z, strain] = normals.subarray(4 * v, 4 * v + 4);
    expect(Math.max(Math.abs(x), Math.abs(y), Math.abs(z))).toBeCloseTo(1, 6);
    // Outwards: the face that the normal names.
    const place = surface.positions.subarray(3 * smooth.node[v], 3 * smooth.node[v] + 3);
    expect(x * place[0] + y * place[1] + z * place[2]).toBeCloseTo(0.05, 6);
    expect(strain).toBe(0);
  }
  const euler = surface.nodes + surface.corners.length / 3 - 2;
  expect(smooth.edges.length / 2).toBe(euler);
});

test("without a crease all is one part", () => {
  expect(smoothParts(surface, Math.PI).vertices).toBe(surface.nodes);
});

test("places are rest, modes and dents together", () => {
  const list = waves(6);
  const shapes = readShapes(bytes(shapesBytes(box, list, 0.1)));
  const q = Float32Array.of(1e-3, 0, -2e-3, 0, 0, 5e-4);
  const shape = { form: "modal" as const, q, unit: 1e-5, nodes: Uint32Array.of(3, 3), dents: Int8Array.of(0, 0, 0, 100, -50, 25) };
  const places = placesOf(surface, shapes, shape);
  const table = halfTable();
  const expected = surface.positions[9] + [0, 2, 5].reduce((sum, k) => sum + q[k] * table[shapes.halves[3 * (k * surface.nodes + 3)]], 0);
  expect(places[9]).toBeCloseTo(expected + 1e-3, 7);
});

test("the strain of a triangle is the change of length where it is largest", () => {
  const rest = [1, 0, 0, 0.3, 1, 0];
  const stretched = (x: number, y: number) => [x, 0, 0, 0.3 * x, y, 0];
  expect(triangleStrain(rest, stretched(1.1, 1))).toBeCloseTo(0.1, 10);
  expect(triangleStrain(rest, stretched(1, 0.7))).toBeCloseTo(0.3, 10);
  // Turned by 90°: no strain.
  expect(triangleStrain(rest, [0, 1, 0, -1, 0.3, 0])).toBeCloseTo(0, 10);
  expect(triangleStrain([1, 0, 0, 2, 0, 0], rest)).toBe(0);
});

test("modes that are left out stay below the bound together", () => {
  expect(leastUsed(Float32Array.of(0.5, -0.125, 0.25, 0), 0.2)).toBe(0.25);
  expect(leastUsed(Float32Array.of(0.25, -0.25), 0.3)).toBe(0.25);
  expect(leastUsed(Float32Array.of(1, 2), 5)).toBe(Infinity);
});
