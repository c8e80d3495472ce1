// Server of a test case: the stand-in, or `palpate serve`.

import { spawn } from "node:child_process";
import { readFile } from "node:fs/promises";
import { createServer as createHttpServer } from "node:http";
import { createServer } from "node:net";
import { availableParallelism } from "node:os";
import { join, normalize } from "node:path";
import { serve } from "../standin/server.mjs";
import { hasPage, startProxy } from "./proxy.mjs";

async function freePort() {
  return new Promise((done, failed) => {
    const server = createServer();
    server.on("error", failed);
    server.listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => done(port));
    });
  });
}

let served = 0;
/** Servers that run, which end with the tests that are stopped. */
const running = new Set();
process.on("exit", () => running.forEach((child) => child.kill()));
for (const signal of ["SIGINT", "SIGTERM"]) process.on(signal, () => process.exit(1));

async function servePalpate(port, { log, scene = "bounce", token, frameAncestor }) {
  const logged = log === undefined ? [] : ["--log", log];
  const framed = frameAncestor === undefined ? [] : ["--frame-ancestor", frameAncestor];
  // Each server keeps a core busy, by default the last one.
  const core = String(served++ % availableParallelism());
  const child = spawn(process.env.PALPATE, ["serve", "--scene", scene, "--listen", `127.0.0.1:${port}`, "--core", core, "--no-browser", ...logged, ...framed], {
    stdio: ["ignore", "pipe", "pipe"],
    env: token === undefined ? process.env : { ...process.env, PALPATE_TOKEN: token },
  });
  running.add(child);
  child.once("exit", () => running.delete(child));
  let output = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (part) => (output += part));
  // The server prints its URL, with a token if it needs one.
  const deadline = Date.now() + 120_000;
  for (;;) {
    const url = output.match(/https?:\/\/[^\s"']+/)?.[0];
    if (url !== undefined) {
      const answers = await fetch(url).then((response) => response.ok).catch(() => false);
      const end = () => new Promise((done) => (child.once("exit", done), child.kill("SIGINT")));
      if (answers) return { url, end };
    }
    if (child.exitCode !== null || Date.now() > deadline) throw new Error(`palpate serve did not start:\n${output}`);
    await new Promise((wake) => setTimeout(wake, 100));
  }
}

/** A case that needs a server. */
export class NeedsServer extends Error {}

const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", json: "application/json", wasm: "application/wasm" };

/** Plain file server of the folder PAGE: the page that runs its scene by itself. */
async function serveFiles({ scene, pace, ...others }) {
  const given = Object.keys(others).filter((key) => others[key] !== undefined && key !== "port");
  if (given.length > 0) throw new NeedsServer(given.join(", "));
  const server = createHttpServer(async (request, response) => {
    const { pathname } = new URL(request.url, "http://localhost");
    const path = decodeURIComponent(pathname.endsWith("/") ? `${pathname}index.html` : pathname);
    try {
      const content = await readFile(join(process.env.PAGE, normalize(path)));
      const type = TYPES[path.split(".").at(-1)] ?? "application/octet-stream";
      response.writeHead(200, { "content-type": type, "content-length": content.length });
      if (pace === undefined) response.end(content);
      else await pace(path, content, response);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(others.port ?? 0, "127.0.0.1", done));
  const { port } = server.address();
  const query = scene === undefined ? "" : `?scene=${scene}`;
  return { url: `http://127.0.0.1:${port}/${query}`, port, close: () => new Promise((done) => (server.close(done), server.closeAllConnections())) };
}

/** Starts a server. `pace`: function of a path, content and response that sends the content, of the plain file server; `port`: reused for a restarted server; `log`: log file of the real server; `scene`: its built-in scene; `token`: its token. */
export async function start(options = {}) {
  if (process.env.PAGE) return serveFiles(options);
  const port = options.port ?? (await freePort());
  if (!process.env.PALPATE) return serve({ ...options, port });
  const behind = await servePalpate(port, options);
  if (await hasPage(behind.url)) return { url: behind.url, port, close: behind.end };
  await behind.end();
  const inner = await freePort();
  const { url, end } = await servePalpate(inner, options);
  const front = await startProxy(url, port);
  return { url: front.url, port, close: async () => (await front.close(), await end()) };
}
