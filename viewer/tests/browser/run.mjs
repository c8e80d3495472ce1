// Browser tests of the page: against the stand-in, or against the real server if PALPATE is the path of the binary.
//   node tests/browser/run.mjs [part of a case's name]      SHOTS=folder saves screenshots

import { mkdirSync } from "node:fs";
import { Browser } from "./browser.mjs";
import { liveCases } from "./live.mjs";
import { logCases } from "./logs.mjs";
import { soundCases } from "./sound.mjs";
import { touchCases } from "./touching.mjs";
import { reconstructionCases } from "./reconstruction.mjs";

if (process.env.SHOTS) mkdirSync(process.env.SHOTS, { recursive: true });
const real = Boolean(process.env.PALPATE);
const filter = process.argv[2] ?? "";
const cases = [...liveCases, ...touchCases, ...reconstructionCases, ...logCases, ...soundCases].filter(({ name }) => name.includes(filter));

const browser = await Browser.open();
let failed = 0;
for (const { name, run, standinOnly, realOnly } of cases) {
  if (real ? standinOnly : realOnly) {
    console.log(`skipped  ${name} (needs the ${real ? "stand-in" : "real server"})`);
    continue;
  }
  const began = performance.now();
  try {
    await run(browser);
    console.log(`passed   ${name} (${((performance.now() - began) / 1000).toFixed(1)} s)`);
  } catch (error) {
    failed++;
    console.log(`FAILED   ${name}\n${error.stack ?? error}`);
  } finally {
    await browser.clear();
  }
}
await browser.close();
console.log(failed === 0 ? "all passed" : `${failed} failed`);
process.exit(failed === 0 ? 0 : 1);
