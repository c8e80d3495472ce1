// The server that a case speaks with: the stand-in, or `palpate serve`.

import { spawn } from "node:child_process";
import { createServer } from "node:net";
import { serve } from "../standin/server.mjs";
import { hasPage, stand } from "./front.mjs";

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

async function serveReally(port, log) {
  const logged = log === undefined ? [] : ["--log", log];
  const child = spawn(process.env.PALPATE, ["serve", "--scene", "bounce", "--listen", `127.0.0.1:${port}`, "--no-browser", ...logged], {
    stdio: ["ignore", "pipe", "pipe"],
  });
  let said = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (part) => (said += part));
  // It says its address, with a token if it wants one.
  const deadline = Date.now() + 120_000;
  for (;;) {
    const url = said.match(/https?:\/\/[^\s"']+/)?.[0];
    if (url !== undefined) {
      const answers = await fetch(url).then((response) => response.ok).catch(() => false);
      const end = () => new Promise((done) => (child.once("exit", done), child.kill("SIGINT")));
      if (answers) return { url, end };
    }
    if (child.exitCode !== null || Date.now() > deadline) throw new Error(`palpate serve did not begin:\n${said}`);
    await new Promise((wake) => setTimeout(wake, 100));
  }
}

/** `port`: the one from before, for a server that comes back. `log`: where the real one logs what happens. */
export async function start(options = {}) {
  const port = options.port ?? (await freePort());
  if (!process.env.PALPATE) return serve({ ...options, port });
  const behind = await serveReally(port, options.log);
  if (await hasPage(behind.url)) return { url: behind.url, port, close: behind.end };
  await behind.end();
  const inner = await freePort();
  const { url, end } = await serveReally(inner, options.log);
  const front = await stand(url, port);
  return { url: front.url, port, close: async () => (await front.close(), await end()) };
}
