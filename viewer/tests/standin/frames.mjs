// Frame encoder of the stand-in (docs/viewer-protocol.md, "Frames").

class Writer {
  constructor() {
    this.parts = [];
  }
  u32(...values) {
    this.parts.push(Buffer.from(Uint32Array.from(values).buffer));
  }
  f32(...values) {
    this.parts.push(Buffer.from(Float32Array.from(values).buffer));
  }
  f64(value) {
    this.parts.push(Buffer.from(Float64Array.of(value).buffer));
  }
  padded(array) {
    const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength);
    this.parts.push(bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4));
  }
  bytes() {
    return Buffer.concat(this.parts);
  }
}

/** Residual displacements with node differences of at most 65,535; a longer gap gets a node of displacement 0. */
export function encodeResiduals(residuals, writer) {
  const largest = residuals.reduce((most, { u }) => Math.max(most, ...u.map(Math.abs)), 0);
  const unit = largest / 127;
  const differences = [];
  const values = [];
  let at = 0;
  for (const { node, u } of residuals) {
    while (node - at > 0xffff) {
      differences.push(0xffff);
      values.push(0, 0, 0);
      at += 0xffff;
    }
    differences.push(node - at);
    values.push(...u.map((x) => (unit > 0 ? Math.round(x / unit) : 0)));
    at = node;
  }
  writer.u32(differences.length);
  writer.f32(unit);
  writer.padded(Uint16Array.from(differences));
  writer.padded(Int8Array.from(values));
}

export function encodeFrame(box, format, generation, scene) {
  const writer = new Writer();
  writer.u32(0x46504c50, format === "modal" ? 1 : 2, generation, box.step);
  writer.f64(box.time);
  writer.f32(...box.energies());
  const contacts = box.contacts.filter((contact) => Math.hypot(...contact.force) > 1e-9).slice(0, 64);
  writer.u32(1, scene.obstacles.length, box.devices.length, contacts.length, 0, 0);
  writer.f32(...box.position, ...box.orientation);
  if (format === "modal") {
    writer.u32(box.q.length);
    writer.f32(...box.q);
    encodeResiduals(box.residuals(), writer);
  } else {
    const positions = box.positions();
    writer.u32(positions.length / 3);
    writer.padded(positions);
  }
  for (const obstacle of scene.obstacles) writer.f32(...obstacle.pose);
  for (const device of box.devices) {
    writer.u32(device.mode);
    writer.f32(...device.position, ...device.proxy, ...device.force);
  }
  for (const { object, kind, number, point, force, slip } of contacts) {
    writer.u32(kind | (object << 2) | (number << 17));
    writer.f32(...point, ...force, slip);
  }
  return writer.bytes();
}
