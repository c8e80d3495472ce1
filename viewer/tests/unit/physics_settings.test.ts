import { expect, test } from "vitest";
import type { SceneMessage } from "../../src/protocol/messages";
import { complaint } from "../../src/ui/number_field";
import { changeTo, physicsOf, restoration } from "../../src/ui/physics_settings";

const scene = (title: string, change: { gravity?: number; step_s?: number; friction?: number; stiffness?: number } = {}): SceneMessage => {
  const { gravity = 9.81, step_s = 0.001, friction = 0.5, stiffness = 200 } = change;
  const device = { name: "finger", pointer: true, tip_radius: 0.005, patch_radius: 0.01, friction, coupling: { stiffness, damping: 0.5 } };
  return { id: title, title, gravity: [0, -gravity, 0], step_s, devices: [{ ...device, name: "hand", pointer: false, friction: 9, coupling: null }, device], obstacles: [] } as unknown as SceneMessage;
};

test("settings are those of the first pointer", () => {
  expect(physicsOf(scene("a"))).toEqual({ gravity: [0, -9.81, 0], step: 0.001, friction: 0.5, coupling: { stiffness: 200, damping: 0.5 } });
});

test("only what was changed goes back to what the scene came with", () => {
  const own = { ...scene("a"), materials: [] };
  const back = (change: Parameters<typeof scene>[1]) => restoration({ ...scene("a", change), own });
  expect(back({})).toBeNull();
  expect(back({ gravity: 1.62, stiffness: 300 })).toEqual({ type: "set_physics", gravity: [0, -9.81, 0], coupling: { stiffness: 200, damping: 0.5 } });
  expect(back({ friction: 0.1, step_s: 0.002 })).toEqual({ type: "set_physics", step: 0.001, friction: 0.5 });
});

test("gravity that was 0 comes back along the scene's down direction", () => {
  const floor = (normal: readonly number[]) => ({ name: "floor", shape: { plane: {} }, pose: [0, 0, 0, ...normal], friction: 0.5 });
  // Turns y to z, and to −x.
  const [upwards, tilted] = [floor([Math.SQRT1_2, 0, 0, Math.SQRT1_2]), floor([0, 0, Math.SQRT1_2, Math.SQRT1_2])];
  const raised = (change: Partial<SceneMessage>) => changeTo({ gravity: 2 }, { ...scene("a", { gravity: 0 }), ...change })?.gravity?.map((x) => Math.round(x * 1e9) / 1e9 + 0);
  expect(raised({})).toEqual([0, -2, 0]);
  expect(raised({ obstacles: [upwards, tilted] })).toEqual([0, 0, -2]);
  expect(raised({ obstacles: [tilted] })).toEqual([2, 0, 0]);
  expect(raised({ obstacles: [tilted], own: { ...scene("a"), gravity: [0, 0, -9.81], materials: [] } })).toEqual([0, 0, -2]);
  expect(raised({ obstacles: [upwards], gravity: [3, 0, 0] })).toEqual([2, 0, 0]);
});

test("a field complains in its own unit", () => {
  const bounds = { min: 0.2, max: 10, step: "any" } as const;
  const of = (text: string) => complaint("Time step", "ms", bounds, text)?.replaceAll("\u00a0", " ") ?? null;
  expect([of("1"), of("0.2"), of("10")]).toEqual([null, null, null]);
  expect(of("0.05")).toBe("Time step: from 0.2 to 10 ms, not 0.05.");
  expect(of("")).toBe("Time step: from 0.2 to 10 ms.");
  expect(of("abc")).toBe("Time step: from 0.2 to 10 ms.");
  expect(complaint("Friction", "", { min: 0, max: 5, step: "any" }, "9")).toBe("Friction: from 0 to 5, not 9.");
});
