// Logs of the stand-in: a finger presses the top of the cube and drags it sideways.

import { encodeFrame } from "./frames.mjs";
import { makeScene } from "./scenes.mjs";

const FRAME_STEPS = 16;
const SECONDS = 4;

export function recordLog(index, options) {
  const { box, message } = makeScene("bounce", index + 1, options);
  const [finger] = box.devices;
  const frames = [];
  const series = { t: [], devices: box.devices.map((_, i) => ({ name: `finger ${i + 1}`, force: [] })), energy: { kinetic: [], elastic: [], residual: [], potential: [], coupling: [], input: [], dissipated: [], friction: [], impact: [], defect: [] } };
  for (let step = 0; step < SECONDS * 1000; step++) {
    const t = box.time;
    if (t > 1 && finger.mode === 0) Object.assign(finger, { mode: 1, position: [0.01, 0.12, 0.01], target: [0.01, 0.12, 0.01], anchor: null });
    if (t > 1) finger.target = [0.01 + (0.02 + 0.01 * index) * Math.sin(2 * t), 0.098 - 0.012 * Math.sin(3 * (t - 1)) ** 2, 0.01];
    if (step % FRAME_STEPS === 0) {
      frames.push(encodeFrame(box, "modal", index + 1, message));
      series.t.push(t);
      box.devices.forEach((device, i) => series.devices[i].force.push(device.force));
      const energies = box.energies();
      Object.keys(series.energy).forEach((name, i) => series.energy[name].push(energies[i]));
    }
    box.advance();
  }
  const frame_interval_s = FRAME_STEPS / 1000;
  return { name: ["pressed.mcap", "pressed-wider.mcap"][index] ?? `log ${index}`, box, frames, series, message: { ...message, frames: frames.length, frame_interval_s } };
}
