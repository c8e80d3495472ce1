// Sound in films: at its pitch while it is on, silent after it is turned off, and no track without it.

import { readFile } from "node:fs/promises";
import { ENCODED_MS, assert, assertNoConsoleErrors, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

/** Waits until the film is longer by some seconds. */
async function filmOn(page, seconds) {
  const time = () => page.evaluate(() => document.querySelector(".film:not([hidden]) .time")?.textContent ?? "0:00");
  const inSeconds = (text) => text.split(":").reduce((sum, part) => 60 * sum + Number(part), 0);
  const end = inSeconds(await time()) + seconds;
  while (inSeconds(await time()) < end) await page.waitForTimeout(100);
}

/** Film of some seconds; `during` acts when it runs. */
async function filmOf(page, during) {
  await page.keyboard.press("s");
  await page.click('.share-dialog button:text-is("Record")');
  await during();
  const downloading = page.waitForEvent("download", { timeout: ENCODED_MS });
  await page.click(".film >> text=Stop");
  return readFile(await (await downloading).path());
}

/** Length of the sound [s], and amplitudes of 440 Hz in each of its tenths of a second; null without sound. */
async function soundOf(browser, film) {
  const page = await browser.page("about:blank");
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const context = new OfflineAudioContext(1, 1, 48000);
    const decoded = await context.decodeAudioData(bytes.buffer).catch(() => null);
    if (decoded === null) return null;
    const samples = decoded.getChannelData(0);
    const window = 4800;
    const amplitudes = [];
    for (let from = 0; from + window <= samples.length; from += window) {
      let [real, imaginary] = [0, 0];
      for (let at = 0; at < window; at++) {
        const phase = (2 * Math.PI * 440 * at) / 48000;
        real += samples[from + at] * Math.cos(phase);
        imaginary += samples[from + at] * Math.sin(phase);
      }
      amplitudes.push((2 * Math.hypot(real, imaginary)) / window);
    }
    return { seconds: decoded.duration, amplitudes };
  }, film.toString("base64"));
}

export const filmSoundCases = [
  {
    name: "share: a film has the sound of the scene while it is on, and none after it is turned off",
    standinOnly: true,
    alone: true,
    async run(browser) {
      const server = browser.keep(await start());
      const page = await browser.page(server.url, { width: 640, height: 480, pictures: true });
      await waitForScene(page);
      const silent = await soundOf(browser, await filmOf(page, () => filmOn(page, 1)));
      assert(silent === null, `a film without sound has ${silent?.seconds} s of it`);

      await page.click("button[title='Sound: off']");
      await page.waitForSelector("button[title*='ms in the buffer']");
      const film = await filmOf(page, async () => {
        await filmOn(page, 2);
        // The film goes on without.
        await page.click("button[title^='Sound: on']");
        await filmOn(page, 3);
      });
      const sound = await soundOf(browser, film);
      assert(sound !== null && sound.seconds > 3.5, `the film has ${sound?.seconds} s of sound`);
      // The tone has 0.25, and the slider 0.7 of its way: 0.12, less where a busy machine leaves gaps.
      const loud = sound.amplitudes.filter((amplitude) => amplitude > 0.06 && amplitude < 0.16).length;
      assert(loud >= 8, `440 Hz is heard for ${loud / 10} s: ${sound.amplitudes.map((x) => x.toFixed(3))}`);
      const last = sound.amplitudes.slice(-10);
      assert(Math.max(...last) < 0.01, `it sounds after it was turned off: ${last.map((x) => x.toFixed(3))}`);
      assertNoConsoleErrors(page);
    },
  },
];
