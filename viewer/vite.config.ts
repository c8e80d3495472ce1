import { defineConfig } from "vite";

// `npm run dev` proxies to a server on this port: the stand-in, or `palpate serve --listen 127.0.0.1:8123`.
const server = process.env.PALPATE_SERVER ?? "http://127.0.0.1:8123";

export default defineConfig({
  base: "./",
  build: { target: "es2022", chunkSizeWarningLimit: 1000, assetsInlineLimit: 0, license: { fileName: "licences.md" }, modulePreload: { polyfill: false } },
  server: {
    proxy: {
      "/session": { target: server, ws: true, changeOrigin: true, headers: { origin: server } },
      "/scene": { target: server, changeOrigin: true },
      "/log": { target: server, changeOrigin: true },
      "/record": { target: server, changeOrigin: true },
      "/image": { target: server, changeOrigin: true },
    },
  },
});
