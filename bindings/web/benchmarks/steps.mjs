// Step times of WebAssembly in Node.js beside those of `palpate run`, in one run: two held points, and two fingers that squeeze a cube on a floor.
//   PALPATE=target/release/palpate node bindings/web/benchmarks/steps.mjs [RECORDING]      the paper's cube without one

import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { load, Recording, Scene, Simulation } from "../dist/index.js";

const ROUNDS = 5;
const palpate = process.env.PALPATE ?? "palpate";
const folder = mkdtempSync(join(tmpdir(), "palpate-bench-"));
const cube = join(folder, "cube.palp");
if (process.argv[2] !== undefined) copyFileSync(process.argv[2], cube);
else execFileSync(palpate, ["record", "box:0.1x0.1x0.1/12x12x12", "--material", "paper", "--order", "1", "--modes", "200", "-o", cube], { stdio: "inherit" });

const object = '[[object]]\nname = "cube"\nrecording = "cube.palp"\n';
const device = (name, rest) => `[[device]]\nname = "${name}"\n${rest}\npath = { file = "${name}.csv" }\n`;
const sway = (side) => {
  const rows = Array.from({ length: 401 }, (_, at) => [at / 200, side * 0.047 + 0.01 * Math.sin((2 * Math.PI * 2 * at) / 200), 0, 0]);
  return `t,x,y,z\n${rows.map((row) => row.join(",")).join("\n")}\n`;
};
const squeeze = (side) => {
  const rows = [[0, side * 0.08, 0.06, 0], [0.3, side * 0.052, 0.06, 0], [0.6, side * 0.047, 0.06, 0], [2, side * 0.047, 0.06, 0.003]];
  return `t,x,y,z\n${rows.map((row) => row.join(",")).join("\n")}\n`;
};
const held = (side) => `mode = "held"\nattach = { object = "cube", point = [${side * 0.05}, 0.0, 0.0] }`;
const touch = 'mode = "touch"\ntip_radius = 0.005\npatch_radius = 0.03\nfriction = 0.8';
const cases = {
  "two held points": [`${object}${device("left", held(-1))}${device("right", held(1))}`, sway],
  "two fingers, floor": [
    `gravity = [0.0, -9.81, 0.0]\nmax_contact_samples = 48\n${object}position = [0.0, 0.05, 0.0]\n[[plane]]\nname = "floor"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\nfriction = 1.0\n${device("left", touch)}${device("right", touch)}`,
    squeeze,
  ],
};

await load();
const recording = Recording.fromBytes(readFileSync(cube));
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
for (const [name, [text, path]] of Object.entries(cases)) {
  const paths = { "left.csv": path(-1), "right.csv": path(1) };
  for (const [file, content] of Object.entries({ ...paths, "scene.toml": text })) writeFileSync(join(folder, file), content);
  const scene = Scene.fromToml(text, { "cube.palp": recording }, paths);
  const ratios = [];
  for (let round = 0; round < ROUNDS; round++) {
    const native = JSON.parse(execFileSync(palpate, ["run", join(folder, "scene.toml"), "--json"], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] })).timing_us;
    const simulation = new Simulation(scene);
    const times = Array.from({ length: Math.round(scene.duration / scene.step) }, () => {
      const begun = performance.now();
      simulation.step();
      return 1000 * (performance.now() - begun);
    });
    times.sort((a, b) => a - b);
    const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))];
    const own = { p50: at(0.5), p99: at(0.99), p999: at(0.999) };
    console.log(`${name}: native ${JSON.stringify(native)}, WebAssembly p50 ${own.p50.toFixed(1)} µs, p99 ${own.p99.toFixed(1)}, p99.9 ${own.p999.toFixed(1)}`);
    ratios.push(own.p50 / native.p50);
  }
  console.log(`${name}: ratio of medians ${median(ratios).toFixed(2)} (${ROUNDS} rounds)`);
}
rmSync(folder, { recursive: true });
