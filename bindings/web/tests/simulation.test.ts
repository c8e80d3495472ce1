import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { beforeAll, describe, expect, it } from "vitest";
import { PalpateError, Recording, Scene, Simulation, type SceneParts } from "../palpate/index.js";
import { block, blockBytes, loadPackage, runNatively } from "./package.js";

beforeAll(loadPackage);

/** Size of the block along its edges [m], from its surface. */
function halfHeight(): number {
  const positions = block().positions;
  return Math.max(...positions.filter((_, at) => at % 3 === 1));
}

const finger = { mode: "touch", tip_radius: 0.004, patch_radius: 0.02, friction: 0.8 } as const;

function pressed(): SceneParts {
  return {
    gravity: [0, -9.81, 0],
    objects: [{ name: "block", recording: block(), position: [0, halfHeight() + 0.0005, 0] }],
    planes: [{ name: "floor", point: [0, 0, 0], normal: [0, 1, 0], friction: 1 }],
    devices: [{ name: "finger", ...finger }],
  };
}

describe("a simulation", () => {
  it("has the bits of `palpate run`, with two fingers that squeeze a block on a floor", () => {
    const half = halfHeight();
    const path = (side: number) =>
      `t,x,y,z\n0,${side * (half + 0.03)},${half},0\n0.2,${side * (half + 0.003)},${half},0.002\n0.5,${side * (half - 0.001)},${half},0\n0.7,${side * (half - 0.001)},${half + 0.004},0\n`;
    const files = { "left.csv": path(-1), "right.csv": path(1) };
    const device = (name: string) => `[[device]]\nname = "${name}"\nmode = "touch"\ntip_radius = 0.004\npatch_radius = 0.02\nfriction = 0.8\npath = { file = "${name}.csv" }\n`;
    const toml = `gravity = [0.0, -9.81, 0.0]\n[[object]]\nname = "block"\nrecording = "block.palp"\nposition = [0.0, ${half + 0.0005}, 0.0]\n[[plane]]\nname = "floor"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\nfriction = 1.0\n${device("left")}${device("right")}`;
    const native = runNatively(toml, { ...files, "block.palp": blockBytes() });
    const simulation = new Simulation(Scene.fromToml(toml, { "block.palp": block() }, files));
    const steps = native.get("t")?.length ?? 0;
    expect(steps).toBe(700);
    let largest = 0;
    for (let step = 0; step < steps; step++) {
      const forces = simulation.step();
      const { poses } = simulation;
      const expected = ["left.fx", "left.fy", "left.fz", "right.fx", "right.fy", "right.fz", "block.px", "block.py", "block.pz", "block.qw"];
      const got = [...forces, ...poses.slice(0, 4)];
      expected.forEach((name, at) => {
        // Both print negative zero in their own way.
        if ((got[at] ?? Number.NaN) !== native.get(name)?.[step]) throw new Error(`step ${step + 1}: ${name} is ${got[at]}, natively ${native.get(name)?.[step]}`);
      });
      largest = Math.max(largest, Math.hypot(forces[0] ?? 0, forces[1] ?? 0, forces[2] ?? 0));
    }
    expect(largest, "the fingers touch").toBeGreaterThan(0.1);
  });

  it("tells once of positions in millimetres, and of a tip that touches nothing", () => {
    const simulation = new Simulation(new Scene(pressed()));
    simulation.step([0, 0.2, 0]);
    expect(simulation.warnings).toEqual([]);
    for (let step = 0; step < 3; step++) simulation.step([0, 200, 0]);
    const [units, nothing, ...others] = simulation.warnings;
    expect(units).toMatch(/the motion of "finger" goes 19\d\.\d m away .*millimetres, divide them by 1000/);
    expect(nothing).toMatch(/finger touched nothing/);
    expect(others).toEqual([]);
    simulation.reset();
    expect(simulation.warnings).toEqual([]);
  });

  it("carries its weight on the floor, and its contacts add up to the net forces", () => {
    const scene = new Scene(pressed());
    const simulation = new Simulation(scene);
    for (let step = 0; step < 6000; step++) simulation.step();
    const weight = (scene.recordings[0]?.mass ?? 0) * 9.81;
    const loads = simulation.obstacleLoads;
    expect(Math.abs((loads[1] ?? 0) / -weight - 1)).toBeLessThan(0.02);
    const sum = simulation.contacts.reduce((total, contact) => total + contact.force[1], 0);
    expect(sum).toBeCloseTo(-(loads[1] ?? 0), 12);
    expect(simulation.contacts.every((contact) => contact.against.kind === "obstacle")).toBe(true);
    expect(Math.abs(simulation.energy.defect ?? 1)).toBeLessThan(1e-12);
  });

  it("touches where the positions say, holds and lets go, and starts again", () => {
    const simulation = new Simulation(new Scene(pressed()));
    const top = 2 * halfHeight() + 0.0005;
    simulation.step();
    expect(simulation.forces[1], "a finger that is nowhere takes no part").toBe(0);
    let force = 0;
    for (let step = 0; step < 300; step++) {
      const forces = simulation.step([0, top + 0.01 - 5e-5 * step, 0]);
      force = Math.max(force, forces[1] ?? 0);
    }
    expect(force, "the block pushes the finger up").toBeGreaterThan(0.1);
    simulation.reset();
    expect(simulation.time).toBe(0);
    simulation.grasp("finger", "block", [0, top, 0]);
    const held = [...simulation.positions];
    for (let step = 1; step <= 400; step++) simulation.step([held[0] ?? 0, (held[1] ?? 0) + 5e-5 * step, held[2] ?? 0]);
    const lifted = simulation.poses[1] ?? 0;
    expect(lifted, "it hangs on the finger").toBeGreaterThan(halfHeight() + 0.01);
    simulation.release("finger");
    simulation.positions.fill(Number.NaN);
    for (let step = 0; step < 300; step++) simulation.step();
    expect(simulation.poses[1] ?? 1, "it falls").toBeLessThan(lifted - 0.005);
  });

  it("gives deformed surfaces in world axes, and its memory does not grow with the steps", () => {
    const simulation = new Simulation(new Scene(pressed()));
    const surface = simulation.surface("block");
    expect(surface.length).toBe(block().positions.length);
    const lowest = Math.min(...surface.filter((_, at) => at % 3 === 1));
    expect(lowest).toBeCloseTo(0.0005, 5);
    const before = simulation.forces.buffer.byteLength;
    const top = 2 * halfHeight();
    for (let step = 0; step < 20_000; step++) simulation.step([0, top + 0.002 * Math.sin(step / 100), 0]);
    simulation.surface("block");
    expect(simulation.forces.buffer.byteLength).toBe(before);
  });

  it("refuses what is wrong with a text that says what it is", () => {
    const simulation = new Simulation(new Scene(pressed()));
    expect(() => simulation.step([1, 2])).toThrow(PalpateError);
    expect(() => simulation.grasp("hand", "block", [0, 0, 0])).toThrow(/no device "hand".*finger/);
    expect(() => simulation.surface(7)).toThrow(/no object 7/);
    expect(() => Scene.fromToml("gravity = 3", {})).toThrow(PalpateError);
    expect(() => Scene.fromToml('[[object]]\nname = "a"\nrecording = "none.palp"', {})).toThrow(/none.palp.*not among the files/);
    expect(() => new Scene({ ...pressed(), step: -1 })).toThrow(/step/);
  });
});

describe("memory", () => {
  it("is freed once, and what was disposed of says so", () => {
    const recording = block();
    const scene = new Scene({ ...pressed(), objects: [{ name: "block", recording, position: [0, halfHeight(), 0] }] });
    recording.dispose();
    recording.dispose();
    expect(() => recording.positions).toThrow(/the recording was disposed of/);
    const simulation = new Simulation(scene);
    simulation.step();
    expect(simulation.surface("block").length).toBe(block().positions.length);
    scene.dispose();
    expect(() => new Simulation(scene)).toThrow(/the scene was disposed of/);
    simulation.step();
    simulation.dispose();
    simulation.dispose();
    expect(() => simulation.step()).toThrow(/the simulation was disposed of/);
    expect(() => simulation.forces).toThrow(PalpateError);
  });

  it("keeps its arrays in place over a reset", () => {
    const simulation = new Simulation(new Scene(pressed()));
    // The first may make the memory grow.
    simulation.reset();
    const { positions, forces } = simulation;
    const top = 2 * halfHeight();
    for (let step = 0; step < 100; step++) simulation.step([0, top - 1e-4 * step, 0]);
    simulation.reset();
    expect([...positions].every(Number.isNaN)).toBe(true);
    expect([...forces]).toEqual([0, 0, 0]);
    positions.set([0, top, 0]);
    simulation.step();
    expect(simulation.positions).toEqual(positions);
  });

  it("has the surfaces of objects whose scene is written in another way", () => {
    const toml = `object = [{ name = "a", 'recording' = 'x.palp' }, { name = "b", recording = "x.palp", position = [1.0, 0.0, 0.0] }] # "soft"`;
    const simulation = new Simulation(Scene.fromToml(toml, { "x.palp": block() }));
    expect(simulation.surface("a").length).toBe(block().positions.length);
    expect(Math.min(...simulation.surface("b").filter((_, at) => at % 3 === 0))).toBeGreaterThan(0.5);
    expect(simulation.scene.recordings.length).toBe(2);
  });
});

describe("a recording", () => {
  it("is rescaled exactly to another Young's modulus and density", () => {
    const [soft, stiff] = [block(), block().rescaled(4 * 1e5, 100)];
    expect(stiff.frequencies.length).toBe(soft.frequencies.length);
    const ratio = (stiff.frequencies[0] ?? 0) / (soft.frequencies[0] ?? 1);
    stiff.frequencies.forEach((frequency, at) => expect(frequency / (soft.frequencies[at] ?? 1) / ratio).toBeCloseTo(1, 12));
    expect(() => block().rescaled(-1, 100)).toThrow(/young_pa/);
  });

  it("is refused when it is damaged", () => {
    const bytes = blockBytes().slice();
    bytes[bytes.length - 1] = (bytes[bytes.length - 1] ?? 0) ^ 1;
    expect(() => Recording.fromBytes(bytes)).toThrow(/hash/);
    expect(() => Recording.fromBytes(new Uint8Array())).toThrow(PalpateError);
  });
});

describe("a scene file", () => {
  it("is read with the files beside it, from the disk and by HTTP, whatever their names hold", async () => {
    const folder = mkdtempSync(join(tmpdir(), "palpate #1 "));
    const names = { recording: "soft block, 100 %.palp", path: "hands/what? #2.csv" };
    const toml = `gravity = [0, -9.81, 0]
[[object]]
name = "block"
recording = "${names.recording}"
[[device]]
name = "hand"
mode = "held"
attach = { object = "block", point = [0, ${halfHeight()}, 0] }
path = { file = "${names.path}" }
`;
    mkdirSync(join(folder, "hands"));
    writeFileSync(join(folder, names.recording), blockBytes());
    writeFileSync(join(folder, names.path), "t,x,y,z\n0,0,0,0\n0.1,0,0.01,0\n");
    writeFileSync(join(folder, "scene.toml"), toml);
    const server = createServer((request, response) => {
      const file = join(folder, decodeURIComponent(new URL(request.url ?? "", "http://localhost").pathname));
      response.writeHead(existsSync(file) ? 200 : 404).end(existsSync(file) ? readFileSync(file) : undefined);
    });
    await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
    const { port } = server.address() as AddressInfo;
    const from = process.cwd();
    try {
      process.chdir(folder);
      const force = async (address: string | URL) => {
        const simulation = new Simulation(await Scene.load(address));
        for (let step = 0; step < 20; step++) simulation.step();
        return [...simulation.forces];
      };
      const forces = await force("scene.toml");
      expect(Math.hypot(...forces)).toBeGreaterThan(0.01);
      expect(await force(pathToFileURL(join(folder, "scene.toml")))).toEqual(forces);
      expect(await force(`http://127.0.0.1:${port}/scene.toml`)).toEqual(forces);
      expect((await Recording.load(encodeURIComponent(names.recording))).mass).toBe(block().mass);
      await expect(Recording.load("missing.palp")).rejects.toThrow(/no such file.*missing.palp/);
      await expect(Recording.load(`http://127.0.0.1:${port}/missing.palp`)).rejects.toThrow(/missing.palp: 404/);
    } finally {
      process.chdir(from);
      server.close();
      rmSync(folder, { recursive: true });
    }
  });
});
