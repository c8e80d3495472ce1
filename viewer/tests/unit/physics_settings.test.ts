import { expect, test } from "vitest";
import type { SceneMessage } from "../../src/protocol/messages";
import { complaint } from "../../src/ui/number_field";
import { OwnSettings, physicsOf } from "../../src/ui/physics_settings";

const scene = (title: string, change: { gravity?: number; step_s?: number; friction?: number; stiffness?: number } = {}): SceneMessage => {
  const { gravity = 9.81, step_s = 0.001, friction = 0.5, stiffness = 200 } = change;
  const device = { name: "finger", pointer: true, tip_radius: 0.005, patch_radius: 0.01, friction, coupling: { stiffness, damping: 0.5 } };
  return { id: title, title, gravity: [0, -gravity, 0], step_s, devices: [{ ...device, name: "hand", pointer: false, friction: 9, coupling: null }, device], obstacles: [] } as unknown as SceneMessage;
};

test("settings are those of the first pointer", () => {
  expect(physicsOf(scene("a"))).toEqual({ gravity: [0, -9.81, 0], step: 0.001, friction: 0.5, coupling: { stiffness: 200, damping: 0.5 } });
});

test("only what was changed goes back to what the scene came with", () => {
  const own = new OwnSettings();
  own.note(scene("a"));
  expect(own.restoration(scene("a"))).toBeNull();
  const changed = scene("a", { gravity: 1.62, stiffness: 300 });
  own.note(changed);
  expect(own.restoration(changed)).toEqual({ type: "set_physics", gravity: [0, -9.81, 0], coupling: { stiffness: 200, damping: 0.5 } });
  own.note(scene("a", { friction: 0.1, step_s: 0.002 }));
  expect(own.restoration(scene("a", { friction: 0.1, step_s: 0.002 }))).toEqual({ type: "set_physics", step: 0.001, friction: 0.5 });
});

test("a scene that is opened again comes with the settings of that start", () => {
  const own = new OwnSettings();
  own.note(scene("a", { gravity: 3 }));
  own.note(scene("b"));
  own.note(scene("a"));
  expect(own.restoration(scene("a", { gravity: 3 }))).toEqual({ type: "set_physics", gravity: [0, -9.81, 0] });
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
