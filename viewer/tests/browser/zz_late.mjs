import { Browser, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";
const browser = await Browser.open();
const server = await start();
for (const scene of process.argv.slice(2)) {
  const url = new URL(server.url); url.searchParams.set("scene", scene);
  const page = await browser.page("about:blank", {});
  await page.addInitScript(() => { const W = Worker; window.Worker = class extends W { constructor(...a) { super(...a); this.addEventListener("message", (e) => { if (e.data.kind === "message") { const m = JSON.parse(e.data.text); if (m.type === "status") { window.lastStatus = m; window.lastAt = performance.now(); } } }); } }; });
  await page.goto(url.href);
  await waitForScene(page);
  await page.waitForTimeout(4000);
  const read = () => page.evaluate(() => [window.lastStatus, window.lastAt]);
  const [a, ta] = await read();
  await page.waitForTimeout(Number(process.env.SECONDS_ ?? 60) * 1000);
  const [b, tb] = await read();
  const steps = b.steps - a.steps, wall = tb - ta;
  console.log(scene, "steps", steps, "in", (wall / 1000).toFixed(2), "s", JSON.stringify(b.force_process), "before", JSON.stringify(a.force_process));
  await page.close();
}
await browser.close(); process.exit(0);
