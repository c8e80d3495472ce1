// Browser tests of the page: against the stand-in, against the real server if PALPATE is the path of the binary, or without a server if PAGE is the
// folder of the page that runs its scene by itself.
//   node tests/browser/run.mjs [part of a case's name]      SHOTS=folder saves screenshots
//   node tests/browser/run.mjs --standin-only               leaves out what runs against the real server, too
//
// A case that fails is run once more: one that passes then is reported as flaky, with its error, and has a fault that is to be repaired.

import { mkdirSync } from "node:fs";
import { Browser } from "./browser.mjs";
import { comparisonCases } from "./comparison.mjs";
import { droppedCases } from "./dropped.mjs";
import { filmSoundCases } from "./film_sound.mjs";
import { firstLoadCases } from "./first_load.mjs";
import { firstViewCases } from "./first_view.mjs";
import { handCases } from "./hand.mjs";
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
const standinOnlyRun = process.argv[2] === "--standin-only";
const filter = standinOnlyRun ? "" : (process.argv[2] ?? "");
const cases = [...firstViewCases, ...liveCases, ...touchCases, ...handCases, ...reconstructionCases, ...logCases, ...comparisonCases, ...droppedCases, ...firstLoadCases, ...robustCases, ...soundCases, ...shareCases, ...sharedMaterialCases, ...filmSoundCases, ...vrCases, ...vibrationCases, ...recordedLogCases].filter(({ name }) => name.includes(filter));

const browser = await Browser.open();
let failed = 0;
let flaky = 0;
for (const { name, run, standinOnly, realOnly, serverOnly, serverlessOnly } of cases) {
  if (standinOnlyRun && !standinOnly) continue;
  if (serverless && serverOnly) {
    console.log(`skipped  ${name} (needs a server)`);
    continue;
  }
  if (!serverless && serverlessOnly) {
    console.log(`skipped  ${name} (needs the page without a server)`);
    continue;
  }
  if (real ? standinOnly : realOnly) {
    console.log(`skipped  ${name} (needs the ${real ? "stand-in" : "real server"})`);
    continue;
  }
  const began = performance.now();
  for (let attempt = 1; attempt <= ATTEMPTS; attempt++) {
    try {
      await run(browser);
      if (attempt > 1) flaky++;
      console.log(`${attempt > 1 ? "FLAKY " : "passed"}   ${name} (${((performance.now() - began) / 1000).toFixed(1)} s)`);
      break;
    } catch (error) {
      if (error instanceof NeedsServer) {
        console.log(`skipped  ${name} (needs a server: ${error.message})`);
        break;
      }
      if (attempt === ATTEMPTS) failed++;
      console.log(`FAILED   ${name}${attempt < ATTEMPTS ? ", and runs again" : ""}\n${error.stack ?? error}`);
    } finally {
      await browser.clear();
    }
  }
}
await browser.close();
console.log(`${failed === 0 ? "all passed" : `${failed} failed`}${flaky > 0 ? `, ${flaky} flaky` : ""}`);
process.exit(failed === 0 ? 0 : 1);
