// Sound: off until it is asked for, heard at its pitch, quiet again.

import { assert, assertNoConsoleErrors, waitForScene } from "./browser.mjs";
import { start } from "./servers.mjs";

/** Lets what goes to the sound device be heard by the test. */
function listen() {
  const connect = AudioNode.prototype.connect;
  AudioNode.prototype.connect = function (to, ...more) {
    if (to instanceof AudioDestinationNode) {
      window.heard = new AnalyserNode(this.context, { fftSize: 32768, smoothingTimeConstant: 0 });
      connect.call(this, window.heard);
    }
    return connect.call(this, to, ...more);
  };
}

/** Loudest frequency [Hz] and its level [dB of full scale]. */
function loudest(page) {
  return page.evaluate(() => {
    const levels = new Float32Array(window.heard.frequencyBinCount);
    window.heard.getFloatFrequencyData(levels);
    const at = levels.indexOf(Math.max(...levels));
    return { hz: (at * window.heard.context.sampleRate) / window.heard.fftSize, level: levels[at] };
  });
}

async function pageWithSound(browser, options) {
  const server = browser.keep(await start(options));
  const page = await browser.page(server.url);
  await waitForScene(page);
  await page.evaluate(listen);
  assert((await page.getAttribute("button[title='Sound: off']", "aria-pressed")) === "false", "sound is off at first");
  await page.click("button[title='Sound: off']");
  // Its tooltip tells the latency once it plays.
  await page.waitForSelector(PLAYING);
  return page;
}

/** Button once sound comes. */
const PLAYING = "button[title*='ms in the buffer']";

export const soundCases = [
  {
    name: "sound is off until it is asked for, has its pitch, and is quiet when it is turned off",
    standinOnly: true,
    alone: true,
    async run(browser) {
      const page = await pageWithSound(browser);
      await page.waitForTimeout(2500);
      const on = await loudest(page);
      assert(Math.abs(on.hz - 440) < 4, `${on.hz} Hz`);
      const title = await page.getAttribute(PLAYING, "title");
      browser.note(`${title}; ${on.hz.toFixed(0)} Hz at ${on.level.toFixed(1)} dB`);
      // The buffer leaves out what is later than 60 ms.
      const buffered = Number(title.match(/(\d+) ms in the buffer/)[1]);
      assert(buffered <= 60, title);
      await page.fill("input.volume", "0.35");
      await page.waitForTimeout(1200);
      const low = await loudest(page);
      // Half of the way is a quarter of the volume, 12 dB; gaps on a busy machine blur it.
      assert(low.level < on.level - 6, `${on.level} and ${low.level} dB`);
      await page.click("button[title^='Sound: on']");
      assert(await page.isHidden("input.volume"), "the volume is hidden without sound");
      assert((await page.getAttribute("button[title='Sound: off']", "aria-pressed")) === "false", "it is off again");
      assertNoConsoleErrors(page);
    },
  },
  {
    name: "a bar of the real server sounds at 440 Hz",
    realOnly: true,
    alone: true,
    async run(browser) {
      const page = await pageWithSound(browser, { scene: "bar" });
      // The mallet strikes every three seconds.
      let found = { hz: 0, level: -Infinity };
      for (let tries = 0; tries < 20 && Math.abs(found.hz - 440) > 3; tries++) {
        await page.waitForTimeout(400);
        found = await loudest(page);
      }
      browser.note(`${found.hz.toFixed(1)} Hz at ${found.level.toFixed(1)} dB, ${await page.getAttribute(PLAYING, "title")}`);
      assert(Math.abs(found.hz - 440) <= 3, `${found.hz} Hz`);
      assertNoConsoleErrors(page);
    },
  },
];
