// Files that the page opens, and the text of a download.

import { expect, test } from "vitest";
import { kindOfFile, logsToShow } from "../../src/ui/open_files";
import { downloadText } from "../../src/ui/first_load";

test("files are told by their endings", () => {
  expect(["run.mcap", "RUN.MCAP", "run.mcap.part"].map(kindOfFile)).toEqual(["log", "log", "log"]);
  expect(["cube.palp", "cube.PALP"].map(kindOfFile)).toEqual(["recording", "recording"]);
  expect(["cube.stl", "mcap", "a.part", ""].map(kindOfFile)).toEqual(["other", "other", "other", "other"]);
});

test("a second log stands beside the first, a third takes the place of both", () => {
  expect(logsToShow([], ["a"])).toEqual(["a"]);
  expect(logsToShow(["a"], ["b"])).toEqual(["a", "b"]);
  expect(logsToShow(["a", "b"], ["c"])).toEqual(["c"]);
  expect(logsToShow(["a"], ["b", "c"])).toEqual(["b", "c"]);
});

test("a download tells bytes and share, or bytes alone", () => {
  expect(downloadText("the simulation", 310_000, 620_000)).toBe("Loading the simulation: 310\u202fkB of 620\u202fkB, 50\u202f%");
  expect(downloadText("the simulation", 1_500_000, null)).toBe("Loading the simulation: 1.50\u202fMB");
});
