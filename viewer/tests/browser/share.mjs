// Share: link, QR code, frame on another page, film.

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import jsQR from "jsqr";
import { ENCODED_MS, assert, assertNoConsoleErrors, latestFrame, overlaps, pixelOf, recordSent, screenshot, waitForRest, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

const serverless = Boolean(process.env.PAGE);
/** A scene that is not the first one. */
const OTHER = serverless || process.env.PALPATE ? "stack" : "obstacles";

const LINK = '[aria-label="Link to this scene"]';
const RECORD = '.share-dialog button:text-is("Record")';
const FRAME = '[aria-label="HTML of a frame with this scene"]';

async function openDialog(page) {
  await page.click('[aria-label="Share: link, QR code, film, log (S)"]');
  await page.waitForSelector("dialog.share-dialog[open]");
}

/** Address of a server with a query. */
function withQuery(server, query) {
  const url = new URL(server.url);
  for (const [name, value] of new URLSearchParams(query)) url.searchParams.set(name, value);
  return url.href;
}

/** Text of the first message that the page shows; messages go by themselves. */
const notification = (page) =>
  page.waitForFunction(() => document.querySelector(".notification span")?.textContent, null, { timeout: 60_000 }).then((text) => text.jsonValue());

/** Value of a Physics field. */
const field = (page, label) => page.locator(`#controls input[aria-label^="${label}"]`).inputValue().then(Number);

const waitForField = (page, label, value) =>
  page.waitForFunction(([name, expected]) => Number(document.querySelector(`#controls input[aria-label^="${name}"]`)?.value) === expected, [label, value]);

async function setField(page, label, value) {
  const { generation } = await latestFrame(page);
  const input = page.locator(`#controls input[aria-label^="${label}"]`);
  await input.fill(String(value));
  await input.press("Enter");
  await page.waitForFunction((g) => window.palpate.sceneView.graphs[0]?.frame?.generation > g, generation);
}

const viewpoint = (page) => page.evaluate(() => window.palpate.sceneView.orbit.viewpoint);

/** Largest difference of two viewpoints, relative to the distance. */
function apart(a, b) {
  const distance = Math.hypot(...a.from.map((x, k) => x - a.to[k]));
  return Math.max(...["from", "to"].flatMap((end) => a[end].map((x, k) => Math.abs(x - b[end][k])))) / distance;
}

/** Pixels of the QR code and what is around it, of a screenshot that is decoded in the page. */
async function pixelsOfCode(page) {
  const { x, y, width: wide, height: high } = await page.locator(".qr-code").boundingBox();
  const around = 12;
  const base64 = (await page.screenshot({ clip: { x: x - around, y: y - around, width: wide + 2 * around, height: high + 2 * around } })).toString("base64");
  const [width, height, data] = await page.evaluate(async (text) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], { type: "image/png" }));
    const context = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height }).getContext("2d");
    context.drawImage(image, 0, 0);
    let bytes = "";
    for (const byte of context.getImageData(0, 0, image.width, image.height).data) bytes += String.fromCharCode(byte);
    return [image.width, image.height, btoa(bytes)];
  }, base64);
  return { width, height, data: new Uint8ClampedArray(Buffer.from(data, "base64")) };
}

/** Server of one HTML page. */
async function serveHtml(html) {
  const server = createServer((_, response) => response.writeHead(200, { "content-type": "text/html" }).end(html));
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => new Promise((done) => (server.close(done), server.closeAllConnections())) };
}

export const shareCases = [
  {
    name: "share: the dialog gives a link, says that it is copied, and its QR code is read in both themes",
    once: true,
    async run(browser) {
      const server = browser.keep(await start());
      for (const [name, options] of [
        ["desk", {}],
        ["desk-dark", { dark: true }],
        ["phone", { width: 390, height: 844, touch: true, scale: 2 }],
        ["phone-dark", { width: 390, height: 844, touch: true, scale: 2, dark: true }],
        ["narrow", { width: 320, height: 568, touch: true, scale: 2 }],
      ]) {
        const page = await browser.page(server.url, options);
        await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
        await waitForScene(page);
        const rows = await page.evaluate(() => new Set([...document.querySelectorAll(".toolbar > .button")].filter((button) => button.offsetParent !== null).map((button) => button.offsetTop)).size);
        assert(rows === 1, `${name}: the toolbar has ${rows} rows`);
        const overlapping = await overlaps(page, [".toolbar > *"]);
        assert(overlapping.length === 0, `${name}: ${overlapping.join("; ")}`);
        await openDialog(page);
        const link = await page.inputValue(LINK);
        const { id } = await page.evaluate(() => window.palpate.sceneView.graphs[0].info);
        assert(link === `${new URL(server.url).origin}/?scene=${id}`, link);
        assert((await page.textContent(".share-dialog .limit")).includes("works on this computer only"), "it does not say that the address is of this computer");

        // The first control copies, and says so for a while, on a slow page between two looks of this test.
        await page.evaluate(() => {
          window.said = [];
          const button = document.querySelector(".share-dialog .primary");
          new MutationObserver(() => window.said.push(button.textContent)).observe(button, { childList: true });
        });
        await page.keyboard.press("Enter");
        await page.waitForFunction(() => window.said.length > 1);
        const said = await page.evaluate(() => [...window.said, document.querySelector(".share-dialog [role=status]").textContent]);
        assert(said.join() === "Copied,Copy link,Copied", `the button says ${said}`);
        assert((await page.evaluate(() => navigator.clipboard.readText())) === link, "another text is copied");

        const box = await page.locator(".share-dialog").boundingBox();
        assert(box.x >= 0 && box.y >= 0 && box.x + box.width <= (options.width ?? 1280) && box.y + box.height <= (options.height ?? 720), `${name}: the dialog leaves the window`);
        const wide = await page.evaluate(() => document.querySelector(".share-dialog").scrollWidth > document.querySelector(".share-dialog").clientWidth);
        assert(!wide, `${name}: the dialog scrolls sideways`);
        await screenshot(page, `share-${name}`);
        await page.locator(".qr-code").scrollIntoViewIfNeeded();
        const { data, width, height } = await pixelsOfCode(page);
        // Strict: many readers take no inverted code.
        const code = jsQR(data, width, height, { inversionAttempts: "dontInvert" });
        assert(code?.data === link, `${name}: the QR code says ${code?.data}`);
        await page.locator(".share-parts > :last-child").scrollIntoViewIfNeeded();
        await screenshot(page, `share-${name}-end`);

        await page.keyboard.press("Escape");
        assert(!(await page.isVisible(".share-dialog")), "Escape does not close it");
        await page.keyboard.press("s");
        await page.waitForSelector("dialog.share-dialog[open]");
        assertNoConsoleErrors(page);
        await page.context().close();
      }
    },
  },
  {
    name: "share: a link brings scene, settings and view to another page, and Reset goes back",
    async run(browser) {
      const first = browser.keep(await start({ scene: "bounce" }));
      const page = await browser.page(first.url);
      await waitForScene(page);
      await page.evaluate((scene) => window.palpate.connection.send({ type: "open_scene", scene }), OTHER);
      await page.waitForFunction((id) => window.palpate.sceneView.graphs[0]?.info.id === id, OTHER);
      await waitForScene(page);
      const own = { gravity: await field(page, "Gravity"), friction: await field(page, "Friction") };
      await setField(page, "Gravity", 3.25);
      await setField(page, "Friction", 0.125);
      await page.evaluate(() => {
        const { orbit } = window.palpate.sceneView;
        orbit.rotate(0.7, 0.2);
        orbit.zoom(0.7);
        orbit.pan(0.1, 0.05);
      });
      await openDialog(page);
      const link = new URL(await page.inputValue(LINK));
      assert(/^\?scene=\w+&gravity=3\.25&friction=0\.125&camera=(-?[\d.]+,){5}-?[\d.]+$/.test(link.search), link.search);
      const sent = await viewpoint(page);
      assertNoConsoleErrors(page);
      await page.context().close();

      const second = browser.keep(await start({ scene: serverless ? undefined : "bounce" }));
      const other = await browser.page(withQuery(second, link.search), { width: 390, height: 844, touch: true, scale: 2 });
      await other.waitForFunction((id) => window.palpate.sceneView.graphs[0]?.info.id === id && window.palpate.sceneView.graphs[0].frame !== null, OTHER);
      await waitForField(other, "Gravity", 3.25);
      await waitForField(other, "Friction", 0.125);
      await other.waitForFunction(() => !window.palpate.sceneView.orbit.isHome);
      const difference = apart(sent, await viewpoint(other));
      assert(difference < 2e-3, `the view differs by ${difference} of its distance`);
      await screenshot(other, "share-opened");
      // Of a server's page the link leaves the address: reloaded, it shows what the server shows then.
      assert(new URL(other.url()).search === (serverless ? new URL(withQuery(second, `${link.search}&ghost=off`)).search : "?ghost=off"), other.url());

      // Links from a page that was opened by a link are that link.
      await openDialog(other);
      assert(new URL(await other.inputValue(LINK)).search.startsWith(`?scene=${OTHER}&gravity=3.25&friction=0.125&camera=`), "another link");
      await other.keyboard.press("Escape");

      await recordSent(other);
      await other.keyboard.press("r");
      await waitForField(other, "Gravity", own.gravity);
      await waitForField(other, "Friction", own.friction);
      assert(await other.evaluate(() => window.palpate.sceneView.orbit.isHome), "the view stays");
      await other.waitForTimeout(1000);
      assert((await other.evaluate(() => window.sent.filter(({ type }) => type === "set_physics").length)) === 1, "settings are sent again");
      assertNoConsoleErrors(other);
    },
  },
  {
    name: "share: what a link asks for in vain is left out, and said",
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(withQuery(server, "?gravity=500&friction=0.25&step_ms=x&camera=1,2"));
      const text = (await notification(page)).replaceAll("\u00a0", " ");
      assert(text === "Left out of the link: Gravity: from 0 to 100 m/s², not 500. Time step: from 0.2 to 10 ms. Camera: position and target as six numbers of metres.", text);
      await waitForScene(page);
      await waitForField(page, "Friction", 0.25);
      assert((await field(page, "Gravity")) < 10, "gravity is changed");
      const lost = await browser.page(withQuery(server, "?scene=moon&gravity=3"));
      assert((await notification(lost)).startsWith('The scene "moon" of the link is not here'), "it does not say that there is no moon");
      await waitForScene(lost);
      assertNoConsoleErrors(page);
      assertNoConsoleErrors(lost);
    },
  },
  {
    name: "share: the token is in no link, and the dialog says so",
    serverOnly: true,
    async run(browser) {
      const token = "a-token-of-this-test-0123456789";
      const server = browser.keep(await start({ token }));
      const page = await browser.page(withQuery(server, `?token=${token}`));
      await waitForScene(page);
      await openDialog(page);
      const dialog = await page.evaluate(() => document.querySelector(".share-dialog").outerHTML + [...document.querySelectorAll(".share-dialog :is(input, textarea)")].map(({ value }) => value).join());
      assert(!dialog.includes(token), "the token is in the dialog");
      assert(dialog.includes("asks for a token"), "the dialog says nothing of the token");
      const { data, width, height } = await pixelsOfCode(page);
      const link = await page.inputValue(LINK);
      assert(jsQR(data, width, height)?.data === link, "the QR code says something else");

      // An address that is not secure has no clipboard of its own.
      await page.evaluate(() => {
        Object.defineProperty(navigator, "clipboard", { value: undefined });
        const selected = () => document.activeElement.value.slice(document.activeElement.selectionStart, document.activeElement.selectionEnd);
        document.addEventListener("copy", () => (window.copied = selected()));
      });
      await page.click(".share-dialog .primary");
      await page.waitForFunction(() => document.querySelector(".share-dialog [role=status]").textContent === "Copied");
      assert((await page.evaluate(() => window.copied)) === link, "the link is not copied without a clipboard");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "share: a scene of the user's own has no link, and a server's page no frame",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url);
      await waitForScene(page);
      await openDialog(page);
      assert((await page.textContent(".share-parts")).includes("lets no other page show it"), "it does not say that frames are refused");
      assert((await page.locator(FRAME).count()) === 0, "there is HTML of a frame");
      const outer = browser.keep(await serveHtml(`<iframe src="${server.url}"></iframe>`));
      const embedding = await browser.page(outer.url);
      await embedding.waitForFunction(() => document.readyState === "complete");
      assert(embedding.consoleErrors.some((text) => text.includes("frame-ancestors")), "the server's page is shown in a frame");

      server.scene.message.id = null;
      const own = await browser.page(server.url);
      await waitForScene(own);
      await openDialog(own);
      assert((await own.textContent(".share-parts")).includes("This scene is your own"), "it does not say that there is no link");
      assert((await own.locator(`${LINK}, .qr-code`).count()) === 0, "there is a link");
      await screenshot(own, "share-own");
      assertNoConsoleErrors(page);
      assertNoConsoleErrors(own);
    },
  },
  {
    name: "share: a server's page works in a frame of an origin that it names",
    realOnly: true,
    serverOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ frameAncestor: "http://127.0.0.1:*" }));
      const quiet = withQuery(server, "?ghost=off");
      const outer = browser.keep(await serveHtml(`<!doctype html><title>notebook</title><iframe src="${quiet}" style="width: 800px; height: 500px"></iframe>`));
      const embedding = await browser.page(outer.url);
      const inner = embedding.frames().find((frame) => frame.url().startsWith(new URL(server.url).origin));
      assert(inner !== undefined, "the frame does not load");
      await waitForScene(inner);
      const { time } = await latestFrame(inner);
      await inner.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame.time > before + 0.5, time, { timeout: 60_000 });
      await screenshot(embedding, "share-notebook");
      assertNoConsoleErrors(embedding);
    },
  },
  {
    name: "share: the page without a server works in a frame of another origin, also with a timer alone",
    serverlessOnly: true,
    async run(browser) {
      const server = browser.keep(await start({ scene: "bounce" }));
      const page = await browser.page(server.url);
      await waitForScene(page);
      await openDialog(page);
      const html = await page.inputValue(FRAME);
      assert(html.startsWith(`<iframe src="${new URL(server.url).origin}/?scene=bounce" title="palpate: `), html);
      await page.context().close();

      // Without the ghost finger, which would touch the scene.
      const quiet = html.replace("?scene=bounce", "?scene=bounce&amp;ghost=off");
      const outer = browser.keep(await serveHtml(`<!doctype html><title>outer</title><p>A page of somebody else.</p>${quiet}`));
      for (const shared of [true, false]) {
        const embedding = await browser.page("about:blank");
        if (!shared) {
          // No shared memory, as in browsers that give it to isolated pages only.
          await embedding.route(/scene_worker/, async (route) => {
            const response = await route.fetch();
            const without = "WebAssembly.Memory = class { constructor() { throw new TypeError('no shared memory'); } };";
            await route.fulfill({ response, body: without + (await response.text()) });
          });
        }
        await embedding.goto(outer.url);
        await embedding.waitForSelector("iframe");
        const frame = embedding.frames()[1];
        await waitForScene(frame);
        assert(!(await frame.evaluate(() => crossOriginIsolated)), "the frame is isolated");
        assert(new URL(frame.url()).origin !== new URL(embedding.url()).origin, "one origin");
        await waitForRest(frame, 60_000);
        // Whatever the machine's pace, a second of the scene goes by.
        const { time } = await latestFrame(frame);
        await frame.waitForFunction((before) => window.palpate.sceneView.graphs[0].frame.time > before + 1, time, { timeout: 60_000 });
        const inner = await pixelOf(frame, 0, 0.2);
        const box = await embedding.locator("iframe").boundingBox();
        await embedding.mouse.move(box.x + inner.x, box.y + inner.y);
        await embedding.mouse.down();
        await frame.waitForFunction(() => window.palpate.sceneView.graphs[0].frame.devices.some(({ mode, force }) => mode === "touch" && Math.hypot(...force) > 0.01), null, { timeout: 60_000 });
        if (shared) await screenshot(embedding, "share-frame");
        await embedding.mouse.up();
        assertNoConsoleErrors(embedding);
        await embedding.context().close();
      }
    },
  },
  {
    name: "share: a film holds both canvases, has a length, and plays",
    once: true,
    alone: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { width: 800, height: 560, pictures: true });
      await waitForScene(page);
      // A patch of the overlay that only the film of both canvases has.
      await page.evaluate(() => {
        const { sceneView } = window.palpate;
        const before = sceneView.drawOverlay;
        sceneView.drawOverlay = (context, view) => {
          before?.(context, view);
          context.fillStyle = "#ff00ff";
          context.fillRect(view.x + view.width / 2 - 40, view.y + 8, 80, 40);
        };
      });
      await openDialog(page);
      await page.click(RECORD);
      await page.waitForSelector(".film:not([hidden])");
      await page.waitForFunction(() => document.querySelector(".film .time").textContent >= "0:02");
      await screenshot(page, "share-film");
      const downloading = page.waitForEvent("download", { timeout: ENCODED_MS });
      await page.click(".film >> text=Stop");
      const download = await downloading;
      const { id } = await page.evaluate(() => window.palpate.sceneView.graphs[0].info);
      assert(new RegExp(`^palpate-${id}-\\d{4}-\\d\\d-\\d\\d\\.webm$`).test(download.suggestedFilename()), download.suggestedFilename());
      const film = await readFile(await download.path());
      assert(film.readUInt32BE(0) === 0x1a45dfa3, "it is no WebM");
      assert(!(await page.isVisible(".film")), "the box stays");
      await page.waitForSelector(`text=${download.suggestedFilename()}`);
      assert(await page.evaluate(() => window.palpate.sceneView.drawn === null), "frames are still taken");

      // One that gets too long ends by itself.
      await page.keyboard.press("s");
      await page.click(RECORD);
      await page.waitForFunction(() => document.querySelector(".film:not([hidden]) .time")?.textContent >= "0:01");
      const ending = page.waitForEvent("download", { timeout: ENCODED_MS });
      await page.evaluate(() => {
        const now = performance.now.bind(performance);
        performance.now = () => now() + 180_000;
      });
      await ending;
      await page.waitForSelector("text=The film has its largest length");
      assertNoConsoleErrors(page);

      // Played by a page without the server's policy, which has no films.
      const player = await browser.page("about:blank");
      const { duration, colours, patch } = await player.evaluate(async (base64) => {
        const video = document.createElement("video");
        video.muted = true;
        video.src = URL.createObjectURL(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: "video/webm" }));
        document.body.append(video);
        const next = (name) => new Promise((done, failed) => (video.addEventListener(name, done, { once: true }), video.addEventListener("error", () => failed(new Error(video.error.message)), { once: true })));
        await next("loadeddata");
        const { duration: length } = video;
        const seeked = next("seeked");
        video.currentTime = 1;
        await seeked;
        const context = Object.assign(document.createElement("canvas"), { width: video.videoWidth, height: video.videoHeight }).getContext("2d");
        context.drawImage(video, 0, 0);
        const { data } = context.getImageData(0, 0, video.videoWidth, video.videoHeight);
        const seen = new Set();
        for (let i = 0; i < data.length; i += 4 * 97) seen.add((data[i] >> 3) + "," + (data[i + 1] >> 3) + "," + (data[i + 2] >> 3));
        const ratio = video.videoWidth / 800;
        return { duration: length, colours: seen.size, patch: [...context.getImageData(Math.round(video.videoWidth / 2), Math.round(28 * ratio), 1, 1).data] };
      }, film.toString("base64"));
      await screenshot(player, "share-film-played");
      assert(duration > 1 && duration < 600, `the film has a length of ${duration} s`);
      assert(colours > 20, `a picture of the film has ${colours} colours`);
      assert(patch[0] > 200 && patch[1] < 80 && patch[2] > 200, `the overlay is not in the film: ${patch}`);
    },
  },
  {
    name: "share: a browser without MediaRecorder says that it records no film",
    standinOnly: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page("about:blank");
      await page.addInitScript(() => delete window.MediaRecorder);
      await page.goto(withQuery(server, "?ghost=off"));
      await waitForScene(page);
      await openDialog(page);
      assert((await page.textContent(".share-parts")).includes("This browser records no film"), "it does not say so");
      assert(!(await page.isVisible(RECORD)), "it offers a film");
      assertNoConsoleErrors(page);
    },
  },
];
