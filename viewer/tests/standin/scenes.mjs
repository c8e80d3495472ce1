// Scenes of the stand-in.

import { Box, TIP } from "./physics.mjs";

const MATERIAL = { young: 2000, poisson: 0.45, density: 110 };
const FLOOR = { name: "floor", shape: { plane: {} }, pose: [0, 0, 0, 0, 0, 0, 1], friction: 0.5 };

export const SCENES = [
  { id: "bounce", title: "Cube on a floor", about: "A jelly cube of 10 cm falls on a floor. Poke it, push it about, throw it.", box: {}, obstacles: [FLOOR] },
  // Opened without gravity: its floor tells where down is.
  { id: "upright", title: "Cube over a floor, z upwards", about: "It has no gravity until you give it some.", box: { floor: false, height: 0 }, gravity: [0, 0, 0], obstacles: [{ ...FLOOR, pose: [0, 0, -0.2, Math.SQRT1_2, 0, 0, Math.SQRT1_2] }] },
  { id: "float", title: "Weightless cube", about: "The same cube without gravity: push it, and it goes away slowly.", box: { floor: false, height: 0 }, gravity: [0, 0, 0], obstacles: [] },
  {
    id: "obstacles",
    title: "Among obstacles",
    about: "A cube beside a ball, a box and a capsule that stand still.",
    box: {},
    obstacles: [
      FLOOR,
      { name: "ball", shape: { sphere: { radius: 0.03 } }, pose: [0.13, 0.03, 0, 0, 0, 0, 1], friction: 0.5 },
      { name: "block", shape: { box: { half_extents: [0.03, 0.02, 0.05] } }, pose: [-0.13, 0.02, 0, 0, 0.2, 0, 0.98], friction: 0.5 },
      { name: "rod", shape: { capsule: { radius: 0.015, half_length: 0.05 } }, pose: [0, 0.015, -0.13, 0, 0, 0.7071, 0.7071], friction: 0.5 },
    ],
  },
];

export function makeScene(id, generation, options) {
  const found = SCENES.find((scene) => scene.id === id) ?? SCENES[0];
  const box = new Box({ ...found.box, ...options });
  if (found.gravity !== undefined) box.gravity = found.gravity;
  const devices = box.devices.map((_, i) => ({
    name: ["finger", "second finger", "third finger"][i],
    pointer: true,
    tip_radius: TIP,
    patch_radius: 0.01,
    friction: box.friction,
    coupling: box.coupling,
  }));
  const message = {
    type: "scene",
    generation,
    id: found.id,
    title: found.title,
    about: found.about,
    step_s: 0.001,
    gravity: box.gravity,
    warnings: options?.warnings ?? [],
    objects: [
      {
        name: "cube",
        nodes: box.nodes,
        triangles: box.surface.indices.length / 3,
        modes: box.waves.length,
        radius: 0.087,
        mass: 0.11,
        fixed: false,
        material: MATERIAL,
        recordable: true,
        certificate: [
          "force error 0.23 % at most, 0.12 % in the median (one place pressed in 50 ms, over 500 ms)",
          "against the unreduced mesh with all its 6585 modes; 200 are kept; 12 points and patches",
          "This is the stand-in: these lines are an example, and its motion is made up.",
        ],
      },
    ],
    obstacles: found.obstacles,
    devices,
    own: { step_s: 0.001, gravity: box.gravity, obstacles: found.obstacles, devices, materials: [MATERIAL] },
    view: { center: box.position, radius: found.obstacles.length > 1 ? 0.17 : 0.087 },
  };
  return { box, message };
}
