import { expect, test } from "vitest";
import { wantsGhost } from "../../src/interaction/ghost_finger";
import type { SceneObject } from "../../src/protocol/messages";
import { statedError, why } from "../../src/ui/hint";

const lines = (error: string) => ["certificate against the unreduced mesh with all its 2919 modes; 150 are kept", `force error ${error} at most, 0.10 % in the median (one place pressed in 50 ms, over 500 ms)`, "bandwidth 78.2 Hz"];
const object = (...certificate: string[]) => ({ certificate }) as SceneObject;
const plain = (text: string) => text.replaceAll("\u202f", " ");

test("the error is the largest of all objects, as the certificates state it", () => {
  expect(plain(statedError([lines("0.26 %"), lines("1.4 %")]) ?? "")).toBe("1.4 %");
  expect(plain(statedError([lines("below 0.01 %")]) ?? "")).toBe("0.01 %");
  expect(statedError([lines("0.26 %"), []])).toBeNull();
  expect(statedError([])).toBeNull();
});

test("one line says why: the rate of the scene, and its error", () => {
  expect(plain(why({ step_s: 0.001, objects: [object(...lines("0.26 %"))] }))).toBe("Finite-element forces at 1 kHz, a press within 0.26 % of the full model");
  expect(plain(why({ step_s: 0.005, objects: [object()] }))).toBe("Finite-element forces at 200 Hz, with a stated error");
});

test("there is no ghost finger where less motion is wanted, or by its parameter", () => {
  expect(wantsGhost("http://127.0.0.1:7400/", false)).toBe(true);
  expect(wantsGhost("http://127.0.0.1:7400/", true)).toBe(false);
  expect(wantsGhost("http://127.0.0.1:7400/?token=x&ghost=off", false)).toBe(false);
});
