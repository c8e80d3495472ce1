// Browser tests of the page: against the stand-in, against the real server if PALPATE is the path of the binary, or without a server if PAGE is the
// folder of the page that runs its scene by itself.
//   node tests/browser/run.mjs [part of a case's name]      SHOTS=folder saves screenshots
//   node tests/browser/run.mjs --standin-only               leaves out what runs against the real server, too
//
// Cases run side by side, in a browser for each worker; those that are `alone` hear or film the scene in real time, and run after the others. What
// the page does by itself is proved once: against the stand-in, which takes little of the processor, or where a case is to run `once`, not again
// without a server.
// A case that fails is run once more: one that passes then is reported as flaky, with its error, and has a fault that is to be repaired.

import { mkdirSync } from "node:fs";
import { availableParallelism } from "node:os";
import { Browser } from "./browser.mjs";
import { comparisonCases } from "./comparison.mjs";
import { droppedCases } from "./dropped.mjs";
import { filmSoundCases } from "./film_sound.mjs";
import { firstLoadCases } from "./first_load.mjs";
import { firstViewCases } from "./first_view.mjs";
import { handCases } from "./hand.mjs";
import { haplyCases } from "./haply.mjs";
import { liveCases } from "./live.mjs";
import { logCases } from "./logs.mjs";
import { NeedsServer } from "./servers.mjs";
import { shareCases } from "./share.mjs";
import { sharedMaterialCases } from "./shared_material.mjs";
import { soundCases } from "./sound.mjs";
import { touchCases } from "./touching.mjs";
import { robustCases } from "./robust.mjs";
import { vrCases } from "./vr.mjs";
import { vibrationCases } from "./vibration.mjs";
import { recordedLogCases } from "./recorded_log.mjs";
import { reconstructionCases } from "./reconstruction.mjs";

if (process.env.SHOTS) mkdirSync(process.env.SHOTS, { recursive: true });
const ATTEMPTS = 2;
const real = Boolean(process.env.PALPATE || process.env.PAGE);
const serverless = Boolean(process.env.PAGE);
// A scene that runs at 1 kHz takes half a core, and its page as much.
const WORKERS = Number(process.env.WORKERS ?? Math.min(4, availableParallelism() + (real ? 0 : 1)));
const standinOnlyRun = process.argv[2] === "--standin-only";
const filter = standinOnlyRun ? "" : (process.argv[2] ?? "");
const all = [...firstViewCases, ...liveCases, ...touchCases, ...handCases, ...reconstructionCases, ...logCases, ...comparisonCases, ...droppedCases, ...firstLoadCases, ...robustCases, ...soundCases, ...shareCases, ...sharedMaterialCases, ...filmSoundCases, ...vrCases, ...vibrationCases, ...haplyCases, ...recordedLogCases];

/** Why a case is left out; none where it runs. */
function reasonToSkip({ standinOnly, realOnly, serverOnly, serverlessOnly, once }) {
  if (serverless && serverOnly) return "needs a server";
  if (serverless && once) return "runs with a server";
  if (!serverless && serverlessOnly) return "needs the page without a server";
  if (real ? standinOnly : realOnly) return `needs the ${real ? "stand-in" : "real server"}`;
  return null;
}

const wanted = all.filter(({ name, standinOnly }) => name.includes(filter) && (standinOnly || !standinOnlyRun));
for (const one of wanted) if (reasonToSkip(one) !== null) console.log(`skipped  ${one.name} (${reasonToSkip(one)})`);
const cases = wanted.filter((one) => reasonToSkip(one) === null);
let [failed, flaky] = [0, 0];

/** Runs a case, and once more if it fails. */
async function runCase(browser, { name, run }) {
  const began = performance.now();
  for (let attempt = 1; attempt <= ATTEMPTS; attempt++) {
    let outcome;
    try {
      await run(browser);
      if (attempt > 1) flaky++;
      outcome = `${attempt > 1 ? "FLAKY " : "passed"}   ${name} (${((performance.now() - began) / 1000).toFixed(1)} s)`;
    } catch (error) {
      if (error instanceof NeedsServer) outcome = `skipped  ${name} (needs a server: ${error.message})`;
      else if (attempt === ATTEMPTS) failed++;
      else console.log(`FAILED   ${name}, and runs again\n${error.stack ?? error}`);
      outcome ??= attempt === ATTEMPTS && `FAILED   ${name}\n${error.stack ?? error}`;
    } finally {
      await browser.clear();
    }
    if (outcome) return void console.log([outcome, ...browser.notes.splice(0)].join("\n"));
  }
}

/** Runs cases on so many browsers at once. */
async function runAll(queue, workers) {
  const work = async () => {
    const browser = await Browser.open();
    for (let next = queue.shift(); next !== undefined; next = queue.shift()) await runCase(browser, next);
    await browser.close();
  };
  await Promise.all(Array.from({ length: Math.min(workers, queue.length) }, work));
}

await runAll(cases.filter(({ alone }) => !alone), WORKERS);
await runAll(cases.filter(({ alone }) => alone), 1);
console.log(`${failed === 0 ? "all passed" : `${failed} failed`}${flaky > 0 ? `, ${flaky} flaky` : ""}`);
process.exit(failed === 0 ? 0 : 1);
