// Proxy for a server that was built without the page: serves viewer/dist and forwards everything else.

import { existsSync, readFileSync } from "node:fs";
import { createServer, request as send } from "node:http";
import { extname } from "node:path";
import { WebSocket, WebSocketServer } from "ws";

const DIST = new URL("../../dist/", import.meta.url);
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css" };

export async function hasPage(url) {
  return !(await (await fetch(url)).text()).includes("built without its viewer");
}

/** Starts a proxy on `port` in front of the server at the URL `behind`. */
export async function startProxy(behind, port) {
  const { host, search } = new URL(behind);
  const policy = (await fetch(behind)).headers.get("content-security-policy");
  const server = createServer((request, response) => {
    const path = new URL(request.url, "http://x").pathname;
    const file = new URL(`.${path === "/" ? "/index.html" : path}`, DIST);
    if (existsSync(file) && path !== "//") {
      response.setHeader("content-type", TYPES[extname(file.pathname)] ?? "application/octet-stream");
      if (policy !== null) response.setHeader("content-security-policy", policy);
      response.end(readFileSync(file));
      return;
    }
    const headers = { ...request.headers, host, origin: `http://${host}` };
    const passed = send(`http://${host}${request.url}`, { method: request.method, headers }, (answer) => {
      response.writeHead(answer.statusCode, answer.headers);
      answer.pipe(response);
    });
    passed.on("error", () => response.writeHead(502).end());
    request.pipe(passed);
  });
  const sockets = new WebSocketServer({ server });
  sockets.on("connection", (near, request) => {
    const far = new WebSocket(`ws://${host}${request.url}`, { origin: `http://${host}` });
    const waiting = [];
    const pass = (data, binary) => far.send(data, { binary });
    near.on("message", (data, binary) => (far.readyState === WebSocket.OPEN ? pass(data, binary) : waiting.push([data, binary])));
    far.on("open", () => waiting.splice(0).forEach((message) => pass(...message)));
    far.on("message", (data, binary) => near.send(data, { binary }));
    for (const [one, other] of [
      [near, far],
      [far, near],
    ]) {
      one.on("close", () => other.close());
      one.on("error", () => other.terminate());
    }
  });
  await new Promise((done) => server.listen(port, "127.0.0.1", done));
  return {
    url: `http://127.0.0.1:${server.address().port}/${search}`,
    close: () =>
      new Promise((done) => {
        for (const socket of sockets.clients) socket.terminate();
        server.close(done);
        server.closeAllConnections();
      }),
  };
}
