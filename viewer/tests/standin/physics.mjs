// Simplified dynamics of the box: rigid motion with damped modes, springs to the devices, a penalty floor. Plausible,
// not validated.

import { boxSurface, shapeAt, waves } from "./box.mjs";

const SIZE = 0.1;
const MASS = 0.11;
const INERTIA = (MASS * SIZE * SIZE) / 6;
const FIRST_HZ = 17;
const RESIDUAL_STIFFNESS = 900;
const RESIDUAL_RADIUS = 0.014;
const FLOOR_DRAG = 0.6;
export const TIP = 0.006;

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);

function rotate([x, y, z, w], v) {
  const t = scale(cross([x, y, z], v), 2);
  return add(add(v, scale(t, w)), cross([x, y, z], t));
}
const inverseRotate = ([x, y, z, w], v) => rotate([-x, -y, -z, w], v);

export class Box {
  constructor({ cells = 12, modes = 60, height = 0.05, floor = true, devices = 2 } = {}) {
    this.size = SIZE;
    this.surface = boxSurface(SIZE, cells);
    this.waves = waves(modes);
    this.nodes = this.surface.positions.length / 3;
    this.floor = floor;
    this.gravity = [0, -9.81, 0];
    this.friction = 0.6;
    this.coupling = { stiffness: 200, damping: 0.5 };
    this.height = height;
    this.deviceCount = devices;
    const grid = [-0.5, -0.25, 0, 0.25, 0.5];
    this.floorPoints = grid.flatMap((x) => grid.flatMap((y) => grid.map((z) => [x * SIZE, y * SIZE, z * SIZE]))).filter((p) => p.some((x) => Math.abs(x) > 0.49 * SIZE));
    this.floorPoints = this.floorPoints.map((rest) => ({ rest, shape: this.shapesAt(rest) }));
    this.reset();
  }

  reset() {
    this.step = 0;
    this.time = 0;
    this.position = [0, SIZE / 2 + this.height, 0];
    this.velocity = [0, 0, 0];
    this.orientation = [0, 0, 0, 1];
    this.spin = [0, 0, 0];
    this.q = new Float64Array(this.waves.length);
    this.speed = new Float64Array(this.waves.length);
    this.devices = Array.from({ length: this.deviceCount }, () => ({ mode: 0, position: [0, 0, 0], target: [0, 0, 0], proxy: [0, 0, 0], force: [0, 0, 0], residual: 0 }));
    this.contacts = [];
    this.dissipated = 0;
    this.input = 0;
  }

  shapesAt(p) {
    return Float64Array.from(this.waves, (wave) => shapeAt(wave, ...p, SIZE));
  }

  modalDisplacement(shape) {
    const u = [0, 0, 0];
    for (let k = 0; k < this.waves.length; k++) u[this.waves[k].axis] += this.q[k] * shape[k];
    return u;
  }

  modalVelocity(shape) {
    const u = [0, 0, 0];
    for (let k = 0; k < this.waves.length; k++) u[this.waves[k].axis] += this.speed[k] * shape[k];
    return u;
  }

  /** Applies a force [N, world] at a point [m, body]. */
  applyForce(force, arm, shape, h) {
    this.velocity = add(this.velocity, scale(force, h / MASS));
    this.spin = add(this.spin, scale(cross(rotate(this.orientation, arm), force), h / INERTIA));
    const own = inverseRotate(this.orientation, force);
    for (let k = 0; k < this.waves.length; k++) this.speed[k] += (h * own[this.waves[k].axis] * shape[k]) / (0.25 * MASS);
  }

  velocityAt(arm, shape) {
    return add(add(this.velocity, cross(this.spin, rotate(this.orientation, arm))), rotate(this.orientation, this.modalVelocity(shape)));
  }

  advance(h = 0.001) {
    this.step++;
    this.time += h;
    this.velocity = add(this.velocity, scale(this.gravity, h));
    this.contacts = [];
    this.devices.forEach((device, i) => this.deviceContact(device, i, h));
    if (this.floor) {
      const first = this.contacts.length;
      for (const point of this.floorPoints) this.floorContact(point, h);
      for (const contact of this.contacts.slice(first)) this.floorFriction(contact, h);
    }
    for (let k = 0; k < this.waves.length; k++) {
      const omega = 2 * Math.PI * FIRST_HZ * Math.sqrt(this.waves[k].square);
      this.speed[k] = (this.speed[k] - h * omega * omega * this.q[k]) / (1 + h * (6 + 0.12 * omega));
      this.q[k] += h * this.speed[k];
    }
    this.spin = scale(this.spin, 1 - 0.6 * h);
    this.position = add(this.position, scale(this.velocity, h));
    const [x, y, z, w] = this.orientation;
    const [a, b, c] = scale(this.spin, 0.5 * h);
    const next = [x + a * w + b * z - c * y, y + b * w + c * x - a * z, z + c * w + a * y - b * x, w - a * x - b * y - c * z];
    const norm = Math.hypot(...next);
    this.orientation = next.map((value) => value / norm);
  }

  floorContact(point, h) {
    const arm = add(point.rest, this.modalDisplacement(point.shape));
    const at = add(this.position, rotate(this.orientation, arm));
    if (at[1] >= 0) return;
    const force = [0, Math.max(0, -60 * at[1] - 0.25 * this.velocityAt(arm, point.shape)[1]), 0];
    this.applyForce(force, arm, point.shape, h);
    this.contacts.push({ object: 0, kind: 1, number: 0, point: at, force, slip: 0, arm, shape: point.shape });
  }

  /** Friction at a floor contact, after all normal forces: in between, they make the box spin, and it would creep. */
  floorFriction(contact, h) {
    const { arm, shape } = contact;
    const v = add(this.velocity, cross(this.spin, rotate(this.orientation, arm)));
    const slip = Math.hypot(v[0], v[2]);
    const drag = slip > 0 ? Math.min(this.friction * contact.force[1], FLOOR_DRAG * slip) / slip : 0;
    const force = [-drag * v[0], 0, -drag * v[2]];
    this.dissipated += drag * slip * slip * h;
    this.applyForce(force, arm, shape, h);
    Object.assign(contact, { force: add(contact.force, force), slip });
  }

  deviceContact(device, number, h) {
    device.force = [0, 0, 0];
    if (device.mode === 0) {
      device.residual = 0;
      return;
    }
    device.position = add(device.position, scale(sub(device.target, device.position), Math.min(1, 30 * h)));
    const local = inverseRotate(this.orientation, sub(device.position, this.position));
    let rest = device.held;
    let normal = null;
    if (device.mode === 1) {
      // Nearest point of the box at rest.
      const half = SIZE / 2;
      const inside = local.every((x) => Math.abs(x) < half + TIP);
      if (!inside) {
        device.proxy = device.position;
        device.residual *= 0.9;
        device.anchor = null;
        return;
      }
      if (device.anchor == null) {
        const axis = [0, 1, 2].reduce((best, k) => (Math.abs(local[k]) > Math.abs(local[best]) ? k : best), 0);
        device.anchor = { axis, side: Math.sign(local[axis]) };
      }
      const { axis, side } = device.anchor;
      rest = local.map((x, k) => (k === axis ? side * half : Math.max(-half, Math.min(half, x))));
      normal = [0, 0, 0].map((_, k) => (k === axis ? side : 0));
    }
    const shape = this.shapesAt(rest);
    const arm = add(rest, this.modalDisplacement(shape));
    if (normal === null) {
      device.proxy = add(this.position, rotate(this.orientation, arm));
      const pull = add(scale(sub(device.position, device.proxy), this.coupling.stiffness), scale(this.velocityAt(arm, shape), -this.coupling.damping));
      this.applyContact(device, number, pull, arm, rest, shape, h, 0);
      return;
    }
    const depth = TIP - dot(sub(local, arm), normal);
    if (depth <= 0) {
      device.proxy = device.position;
      device.residual *= 0.9;
      return;
    }
    const stiffness = 1 / (1 / this.coupling.stiffness + 1 / RESIDUAL_STIFFNESS);
    const v = this.velocityAt(arm, shape);
    const out = rotate(this.orientation, normal);
    const push = Math.max(0, stiffness * depth + this.coupling.damping * dot(v, out));
    const side = sub(v, scale(out, dot(v, out)));
    const slip = length(side);
    const grip = slip > 0 ? Math.min(this.friction * push, 2 * slip) / slip : 0;
    device.residual = push / RESIDUAL_STIFFNESS;
    device.proxy = add(device.position, scale(out, depth - device.residual));
    this.applyContact(device, number, add(scale(out, -push), scale(side, -grip)), arm, rest, shape, h, slip);
  }

  applyContact(device, number, force, arm, rest, shape, h, slip) {
    device.force = scale(force, -1);
    device.rest = rest;
    this.input += dot(force, this.velocityAt(arm, shape)) * h;
    this.applyForce(force, arm, shape, h);
    const point = add(this.position, rotate(this.orientation, arm));
    this.contacts.push({ object: 0, kind: 0, number, point, force, slip });
  }

  /** Residual displacement of the nodes near devices [m, body]. */
  residuals() {
    const found = [];
    const { positions } = this.surface;
    for (let n = 0; n < this.nodes; n++) {
      const u = [0, 0, 0];
      for (const device of this.devices) {
        if (device.mode === 0 || device.rest === undefined) continue;
        const away = sub([positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]], device.rest);
        const share = Math.exp(-dot(away, away) / (RESIDUAL_RADIUS * RESIDUAL_RADIUS));
        if (share < 0.01) continue;
        const own = scale(inverseRotate(this.orientation, device.force), -share / RESIDUAL_STIFFNESS);
        for (let k = 0; k < 3; k++) u[k] += own[k];
      }
      if (length(u) > 1e-6) found.push({ node: n, u });
    }
    return found;
  }

  positions() {
    const rest = this.surface.positions;
    const positions = rest.slice();
    for (let n = 0; n < this.nodes; n++) {
      const u = this.modalDisplacement(this.shapesAt([rest[3 * n], rest[3 * n + 1], rest[3 * n + 2]]));
      for (let k = 0; k < 3; k++) positions[3 * n + k] += u[k];
    }
    for (const { node, u } of this.residuals()) for (let k = 0; k < 3; k++) positions[3 * node + k] += u[k];
    return positions;
  }

  energies() {
    let [elastic, kinetic] = [0, 0.5 * MASS * dot(this.velocity, this.velocity) + 0.5 * INERTIA * dot(this.spin, this.spin)];
    for (let k = 0; k < this.q.length; k++) {
      const omega = 2 * Math.PI * FIRST_HZ * Math.sqrt(this.waves[k].square);
      elastic += 0.125 * MASS * (omega * this.q[k]) ** 2;
      kinetic += 0.125 * MASS * this.speed[k] ** 2;
    }
    const potential = -MASS * dot(this.gravity, this.position);
    const residual = this.devices.reduce((sum, d) => sum + (0.5 * dot(d.force, d.force)) / RESIDUAL_STIFFNESS, 0);
    const coupling = this.devices.reduce((sum, d) => sum + (0.5 * dot(d.force, d.force)) / this.coupling.stiffness, 0);
    return [kinetic, elastic, residual, potential, coupling, this.input, this.dissipated, 0.1 * this.dissipated, 0, 1e-9 * Math.sin(this.time)];
  }
}
