import { expect, test } from "vitest";
import { count, digits, formatForce, micros, withUnit } from "../../src/format";
import { AutoRange, niceCeil } from "../../src/rendering/auto_range";

const plain = (text: string) => text.replaceAll("\u202f", " ").replaceAll("\u2212", "-");

test("numbers have three digits and an SI prefix", () => {
  const cases: [number, string, string][] = [
    [0.0123, "N", "12.3 mN"],
    [0.9999, "N", "1.00 N"],
    [0.99949, "N", "999 mN"],
    [-1234, "Pa", "-1.23 kPa"],
    [0, "J", "0 J"],
    [3.4e-9, "J", "3.40 nJ"],
    [NaN, "N", "– N"],
  ];
  for (const [value, unit, text] of cases) expect(plain(withUnit(value, unit))).toBe(text);
  expect(plain(withUnit(1e-6, "N", 5e-5))).toBe("0 N");
});

test("a force label keeps its width", () => {
  expect([0, 0.0004, 0.0056, 0.0563, 0.1, 3.14159, 42.4242].map(formatForce).map(plain)).toEqual([
    "0.00 N",
    "0.00 N",
    "5.6 mN",
    "56.3 mN",
    "0.10 N",
    "3.14 N",
    "42.42 N",
  ]);
});

test("times, counts and plain digits", () => {
  expect(plain(micros(21.4))).toBe("21 µs");
  expect(plain(micros(1234))).toBe("1.23 ms");
  expect(plain(count(51234))).toBe("51 234");
  expect(digits(1e-9)).toBe("1.00e\u22129");
});

test("ranges are 1, 2 or 5 times a power of ten, and not below", () => {
  const cases: [number, number][] = [
    [0.0011, 0.002],
    [0.001, 0.001],
    [0.3, 0.5],
    [7, 10],
    [1e-7, 1e-7],
  ];
  for (const [value, range] of cases) expect(niceCeil(value)).toBe(range);
  expect(niceCeil(0)).toBe(0);
});

test("a range grows at once, and shrinks only after a while", () => {
  const range = new AutoRange(0.001);
  expect(range.update(0.3, 0)).toBe(true);
  expect(range.value).toBe(0.5);
  for (let t = 0.1; t < 2.4; t += 0.1) expect(range.update(0.02, t)).toBe(false);
  range.update(0.02, 2.6);
  expect(range.value).toBe(0.02);
  range.update(1e-9, 9);
  range.update(1e-9, 12);
  expect(range.value).toBe(0.001);
});
