// Stand-in server: speaks docs/viewer-protocol.md with a simplified model of a box.
// `pace`: simulated time per real time, as on a slow machine.
//   node tests/standin/server.mjs [--port 8123] [--kind live|logs|render] [--logs 2] [--cells 12] [--modes 60] [--garbage]

import { createReadStream, existsSync, readFileSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { WebSocketServer } from "ws";
import { shapesBytes, surfaceBytes } from "./box.mjs";
import { encodeFrame } from "./frames.mjs";
import { recordLog } from "./logs.mjs";
import { makeScene, SCENES } from "./scenes.mjs";
import { playTone } from "./tone.mjs";

const DIST = fileURLToPath(new URL("../../dist/", import.meta.url));
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };

/** Content security policy of the real server. */
function contentSecurityPolicy() {
  const source = readFileSync(new URL("../../../crates/palpate-viewer/src/server/headers.rs", import.meta.url), "utf8");
  return source.match(/CONTENT_SECURITY_POLICY: &str = "([^"]+)"/)[1].replaceAll(/\\\n\s*/g, "");
}

function argument(name, otherwise) {
  const at = process.argv.indexOf(`--${name}`);
  return at < 0 ? otherwise : (process.argv[at + 1] ?? "");
}

export function serve({ port = 0, kind = "live", logs = 1, cells = 12, modes = 60, garbage = false, render = null, warnings = [], pace = 1 } = {}) {
  const options = { cells, modes, warnings };
  let generation = 1;
  let scene = makeScene("bounce", generation, options);
  let [paused, slowdown, pendingTime, boxBytes] = [false, 1, 0, null];
  const viewers = new Set();
  const images = [];
  const policy = contentSecurityPolicy();
  let recording = null;
  const recorded = kind === "live" ? [] : Array.from({ length: logs }, (_, i) => recordLog(i, options));

  const send = (viewer, message) => viewer.socket.send(JSON.stringify(message));
  const broadcast = (message) => viewers.forEach((viewer) => send(viewer, message));
  const surfaces = () => {
    const { box } = recorded[0] ?? scene;
    boxBytes ??= { surface: surfaceBytes(box.surface), shapes: shapesBytes(box.surface, box.waves, box.size) };
    return boxBytes;
  };

  /** Opens a scene by its id, or the box under the name of an uploaded mesh. */
  function open(id, upload = null) {
    generation++;
    const { gravity, friction, coupling } = scene.box;
    const same = id === scene.message.id;
    const [{ material }] = scene.message.objects;
    scene = makeScene(id, generation, options);
    if (upload !== null) Object.assign(scene.message, { id: null, title: upload, about: "Your own mesh." });
    // A reset keeps changed settings.
    if (same) {
      Object.assign(scene.box, { gravity, friction, coupling });
      scene.message.objects[0].material = material;
    }
    tell();
  }

  /** Sends the scene with its present settings; pointers are free. */
  function tell() {
    const { gravity, friction, coupling, devices } = scene.box;
    for (const device of devices) device.mode = 0;
    Object.assign(scene.message, { generation, gravity, devices: scene.message.devices.map((device) => ({ ...device, friction, coupling })) });
    for (const viewer of viewers) viewer.pointers.clear();
    broadcast(scene.message);
  }

  const http = createServer((request, response) => {
    const url = new URL(request.url, "http://localhost");
    response.setHeader("content-security-policy", policy);
    const answer = (body, type = "application/octet-stream") => response.writeHead(200, { "content-type": type }).end(body);
    if (/^\/scene\/\d+\/object\/0\/surface$/.test(url.pathname)) return answer(surfaces().surface);
    if (/^\/scene\/\d+\/object\/0\/mode_shapes$/.test(url.pathname)) return answer(surfaces().shapes);
    const log = url.pathname.match(/^\/log\/(\d+)\/(frames|series)$/);
    if (log !== null && recorded[log[1]] !== undefined) {
      const { frames, series } = recorded[log[1]];
      if (log[2] === "series") return answer(JSON.stringify(series), "application/json");
      const from = Number(url.searchParams.get("from"));
      const part = frames.slice(from, from + Number(url.searchParams.get("count")));
      return answer(Buffer.concat(part.flatMap((frame) => [Buffer.from(Uint32Array.of(frame.length).buffer), frame])));
    }
    if (request.method === "POST") {
      const parts = [];
      request.on("data", (part) => parts.push(part));
      request.on("end", () => {
        const drawn = url.pathname.match(/^\/image\/(\d+)$/);
        if (drawn !== null) images[drawn[1]] = Buffer.concat(parts);
        else record("mesh", url.searchParams.get("name") ?? "mesh");
        response.writeHead(drawn !== null ? 204 : 202).end();
      });
      return undefined;
    }
    const file = normalize(join(DIST, url.pathname === "/" ? "index.html" : url.pathname));
    if (!file.startsWith(DIST) || !existsSync(file) || !statSync(file).isFile()) return response.writeHead(404).end("not found");
    response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream" });
    return createReadStream(file).pipe(response);
  });

  function record(job, upload = null, material = null) {
    let share = 0;
    const timer = setInterval(() => {
      share += 0.1;
      const phase = share < 0.3 ? "elements" : share < 0.8 ? "modes" : "residual";
      if (share < 1) return broadcast({ type: "progress", job, phase, fraction: share });
      clearInterval(timer);
      broadcast({ type: "progress", job, phase: "certificate", fraction: 1, done: true });
      if (material !== null) scene.message.objects[0].material = material;
      return open(scene.message.id, upload);
    }, 300);
    timer.unref();
    recording = { job, timer };
  }

  function cancelJob() {
    if (recording === null) return;
    clearInterval(recording.timer);
    broadcast({ type: "progress", job: recording.job, phase: "", fraction: 1, done: true });
    broadcast({ type: "info", text: "the recording was cancelled" });
    recording = null;
  }

  function press(viewer, message) {
    const device = scene.box.devices.findIndex((d) => d.mode === 0);
    send(viewer, { type: "assigned", pointer: message.pointer, device: device < 0 ? null : device });
    if (device < 0) return;
    viewer.pointers.set(message.pointer, device);
    const d = scene.box.devices[device];
    Object.assign(d, { mode: message.mode === "hold" ? 2 : 1, position: message.position, target: message.position, proxy: message.position, anchor: null });
    if (message.mode !== "hold") return;
    const { positions, indices } = scene.box.surface;
    d.held = [0, 1, 2].map((k) => message.weights.reduce((sum, w, c) => sum + w * positions[3 * indices[3 * message.triangle + c] + k], 0));
  }

  function release(viewer, pointer) {
    const device = viewer.pointers.get(pointer);
    viewer.pointers.delete(pointer);
    if (device !== undefined) scene.box.devices[device].mode = 0;
  }

  const handlers = {
    press,
    move: (viewer, { pointers }) => {
      for (const { pointer, position } of pointers) {
        const device = viewer.pointers.get(pointer);
        if (device !== undefined) scene.box.devices[device].target = position;
      }
    },
    release: (viewer, { pointer }) => release(viewer, pointer),
    pause: (_, message) => {
      paused = message.paused;
      status();
    },
    single_step: () => {
      if (paused) pendingTime += 0.001;
    },
    slow_motion: (_, message) => {
      slowdown = message.slowdown;
      status();
    },
    reset: () => open(scene.message.id, scene.message.id === null ? scene.message.title : null),
    cancel_job: cancelJob,
    open_scene: (_, message) => open(message.scene),
    set_physics: (viewer, { gravity, step, friction, coupling }) => {
      if (step !== undefined) return send(viewer, { type: "error", text: `the step is ${step} s, the stand-in has 0.001 s only` });
      if (gravity !== undefined) scene.box.gravity = gravity;
      if (friction !== undefined) scene.box.friction = friction;
      if (coupling !== undefined) scene.box.coupling = coupling;
      generation++;
      return tell();
    },
    set_material: (_, { young, poisson, density }) => record("cube", null, { young, poisson, density }),
    stream: (viewer, { format, stride }) => Object.assign(viewer, { format, stride }),
    sound: (viewer, { on }) => {
      clearInterval(viewer.tone);
      if (on) viewer.tone = playTone(viewer, generation);
    },
  };

  const sockets = new WebSocketServer({ server: http, path: "/session" });
  sockets.on("connection", (socket) => {
    const viewer = { socket, format: "modal", stride: 1, count: 0, pointers: new Map(), received: [] };
    viewers.add(viewer);
    send(viewer, {
      type: "hello",
      protocol: 2,
      version: "stand-in",
      kind,
      viewer: viewers.size,
      records: true,
      scenes: kind === "live" ? SCENES.map(({ id, title, about }) => ({ id, title, about })) : [],
      logs: recorded.map(({ name }) => ({ name })),
      ...(kind === "render" ? { render } : {}),
    });
    if (kind === "live") send(viewer, scene.message);
    else recorded.forEach(({ message }, log) => send(viewer, { ...message, log }));
    socket.on("message", (data) => {
      const message = JSON.parse(data.toString());
      viewer.received.push(message);
      handlers[message.type]?.(viewer, message);
    });
    socket.on("close", () => {
      for (const pointer of [...viewer.pointers.keys()]) release(viewer, pointer);
      clearInterval(viewer.tone);
      viewers.delete(viewer);
    });
  });

  let last = performance.now();
  const timers = [];
  function status() {
    const percentiles = { p50: 21, p99: 44, p999: 90, max: 310 };
    broadcast({
      type: "status",
      generation,
      paused,
      slowdown,
      steps: scene.box.step,
      viewers: viewers.size,
      force_process: { compute_us: percentiles, lateness_us: { p50: 8, p99: 60, p999: 140, max: 900 }, overruns: 3, compute_overruns: 0, realtime_priority: false },
    });
  }
  function live() {
    const now = performance.now();
    if (!paused) pendingTime += (pace * Math.min(0.1, (now - last) / 1000)) / slowdown;
    last = now;
    for (; pendingTime >= 0.001; pendingTime -= 0.001) scene.box.advance();
    for (const viewer of viewers) {
      if (viewer.stride === 0 || viewer.count++ % viewer.stride !== 0 || viewer.socket.bufferedAmount > 1e6) continue;
      viewer.socket.send(encodeFrame(scene.box, viewer.format, generation, scene.message));
      viewer.sent = (viewer.sent ?? 0) + 1;
      if (garbage && viewer.sent % 30 === 0) {
        viewer.socket.send(Buffer.from("binary data that is not a frame, and longer than the header of a frame, so that the magic number is read and refused"));
        viewer.socket.send('{"type":"what"');
        viewer.socket.send('{"type":"constructor"}');
      }
    }
  }
  if (kind === "live") timers.push(setInterval(live, 16), setInterval(status, 500));

  const standin = {
    http,
    viewers,
    images,
    get scene() {
      return scene;
    },
    close: () =>
      new Promise((done) => {
        timers.forEach(clearInterval);
        for (const { socket } of viewers) socket.terminate();
        sockets.close();
        http.close(done);
        http.closeAllConnections();
      }),
  };
  return new Promise((ready, failed) => {
    http.on("error", failed);
    http.listen(port, "127.0.0.1", () => {
      standin.port = http.address().port;
      standin.url = `http://127.0.0.1:${standin.port}/`;
      ready(standin);
    });
  });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const frames = Array.from({ length: 10 }, (_, i) => 6 * i);
  const { url } = await serve({
    port: Number(argument("port", 8123)),
    kind: argument("kind", "live"),
    logs: Number(argument("logs", 1)),
    cells: Number(argument("cells", 12)),
    modes: Number(argument("modes", 60)),
    garbage: process.argv.includes("--garbage"),
    render: { frames, width: 1280, height: 720, camera: null, colour: "displacement", dark: false },
  });
  console.log(url);
}
