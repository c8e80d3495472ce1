// Steps a scene at its own rate, and tells the page 60 times a second.

import { Recording, Scene, Simulation } from "../dist/index.js";

const recording = await Recording.load("block.palp");
const half = Math.max(...recording.positions.filter((_, at) => at % 3 === 1));
const scene = new Scene({
  gravity: [0, -9.81, 0],
  objects: [{ name: "block", recording, position: [0, half, 0] }],
  planes: [{ point: [0, 0, 0], normal: [0, 1, 0], friction: 1 }],
  devices: [{ name: "finger", mode: "touch", tip_radius: half / 10, patch_radius: half / 2 }],
});
const simulation = new Simulation(scene);
let steps = 0;
let height = 3 * half;
let wanted = height;
self.onmessage = ({ data }) => (wanted = (3 - 1.5 * data) * half);

let simulated = performance.now();
setInterval(() => {
  const now = performance.now();
  // A machine that is too slow, or was asleep, goes on where it was.
  simulated = Math.max(simulated, now - 50);
  for (; simulated < now; simulated += 1000 * scene.step) {
    // A hand moves; it does not jump.
    height += (wanted - height) / 100;
    simulation.step([0, height, 0]);
    steps += 1;
  }
  self.postMessage({ force: Math.hypot(...simulation.forces), steps });
}, 1000 / 60);
