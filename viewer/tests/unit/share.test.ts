import { expect, test } from "vitest";
import type { ClientMessage, Material, OwnSettings, SceneMessage } from "../../src/protocol/messages";
import type { Vector } from "../../src/protocol/frame";
import { OrbitCamera } from "../../src/rendering/orbit_camera";
import { addressWith, frameHtml, isLoopback, limitsOf } from "../../src/share/addresses";
import { clock, filmName } from "../../src/share/film_control";
import { linkTo, queryOf, readLink, withoutLink } from "../../src/share/link";
import { LinkedStart } from "../../src/share/linked_start";
import { restoration } from "../../src/ui/physics_settings";

const plain = (text: string) => text.replaceAll("\u00a0", " ");

const JELLY: Material = { young: 2000, poisson: 0.45, density: 110 };

interface Change {
  gravity?: Vector;
  step_s?: number;
  friction?: number;
  stiffness?: number;
  coupled?: boolean;
  materials?: (Material | null)[];
  own?: OwnSettings;
}

function scene(id: string, change: Change = {}): SceneMessage {
  const { gravity = [0, 0, -9.81], step_s = 0.001, friction = 0.5, stiffness = 200, coupled = true, materials = [JELLY, JELLY] } = change;
  const device = { name: "finger", pointer: true, tip_radius: 0.005, patch_radius: 0.01, friction, coupling: coupled ? { stiffness, damping: 0.5 } : null };
  const objects = materials.map((material, i) => ({ name: ["cube", "small, round"][i], material, recordable: material !== null }));
  const own = change.own === undefined ? {} : { own: change.own };
  return { id, title: id, gravity, step_s, devices: [device], obstacles: [], objects, ...own } as unknown as SceneMessage;
}

/** Settings with which the scenes of these tests are opened. */
const OWN: OwnSettings = { ...scene("own"), materials: [JELLY, JELLY] };

/** Messages and sentences of a page that starts from a query and gets scenes. */
function start(query: string, ...scenes: SceneMessage[]) {
  return startWith(true, query, ...scenes);
}

/** Messages and sentences of a page that records materials, or rescales them. */
function startWith(records: boolean, query: string, ...scenes: SceneMessage[]): { sent: ClientMessage[]; told: string[]; ends: number; linked: LinkedStart } {
  const result = { sent: [] as ClientMessage[], told: [] as string[], ends: 0 };
  const linked = new LinkedStart(
    query,
    (message) => result.sent.push(message),
    (text) => result.told.push(plain(text)),
    () => (result.ends += 1),
  );
  linked.hello({ records, scenes: ["ball", "stack"].map((id) => ({ id, title: id, about: "" })) });
  for (const message of scenes) linked.scene(message);
  return { ...result, linked };
}

test("a link says what was changed, and nothing else", () => {
  expect(queryOf(linkTo(scene("a", { own: OWN }), null))).toBe("?scene=a");
  const changed = scene("a", { own: OWN, gravity: [0, 0, -3], step_s: 0.002, stiffness: 300 });
  expect(queryOf(linkTo(changed, { from: [0.3, 0.2, 0.4], to: [0, 0.05, -0] }))).toBe("?scene=a&gravity=3&stiffness=300&step_ms=2&camera=0.3,0.2,0.4,0,0.05,0");
});

test("a link says which materials differ from those that the scene was opened with", () => {
  const materials = [JELLY, { young: 1e6 / 3, poisson: 0.3, density: 1100 }];
  expect(queryOf(linkTo(scene("a", { own: OWN, materials }), null))).toBe("?scene=a&material=small%2C%20round,333333,0.3,1100");
  // Several materials in one object have none in common.
  expect(queryOf(linkTo(scene("a", { own: { ...OWN, materials: [JELLY, null] }, materials: [JELLY, null] }), null))).toBe("?scene=a");
});

test("a link is read as it was written", () => {
  const link = { scene: "a&b=c d/é?#%", values: { gravity: 0, friction: 0.123456, stiffness: 1e5, damping: 1e-5, step: 0.2 }, materials: [{ object: "a,b 1", young: 1e12, poisson: 0, density: 0.1 }, { object: "c", ...JELLY }], viewpoint: { from: [1e-4, -2.5, 3] as Vector, to: [0, 0, 0.125] as Vector } };
  const { link: read, leftOut } = readLink(queryOf(link));
  expect(leftOut).toEqual([]);
  expect(read.scene).toBe(link.scene);
  expect(read.values).toEqual(link.values);
  expect(read.materials).toEqual(link.materials);
  const distance = Math.hypot(1e-4, 2.5, 2.875);
  for (const end of ["from", "to"] as const) read.viewpoint?.[end].forEach((x, k) => expect(Math.abs(x - link.viewpoint[end][k])).toBeLessThanOrEqual(1e-3 * distance));
  expect(readLink("")).toEqual({ link: { scene: null, values: {}, materials: [], viewpoint: null }, leftOut: [] });
});

test("a viewpoint is rounded to a thousandth of its distance, near and far", () => {
  for (const distance of [1e-5, 0.04, 1, 730]) {
    const viewpoint = { from: [distance * 0.123456789, 0, 0] as Vector, to: [0, -distance * 0.987654321, 0] as Vector };
    const read = readLink(queryOf({ scene: null, values: {}, materials: [], viewpoint })).link.viewpoint;
    expect(Math.abs((read?.from[0] ?? NaN) - viewpoint.from[0])).toBeLessThanOrEqual(0.5e-3 * distance);
    expect(Math.abs((read?.to[1] ?? NaN) - viewpoint.to[1])).toBeLessThanOrEqual(0.5e-3 * distance);
  }
});

test("what is out of range or no number is left out, with the range of its field", () => {
  const { link, leftOut } = readLink("?gravity=-1&friction=abc&stiffness=&damping=1e5&step_ms=50&camera=1,2,3&ghost=off");
  expect(link).toEqual({ scene: null, values: {}, materials: [], viewpoint: null });
  expect(leftOut.map(plain)).toEqual([
    "Gravity: from 0 to 100 m/s², not -1.",
    "Friction: from 0 to 5.",
    "Coupling stiffness: from 0.1 to 100000 N/m.",
    "Coupling damping: from 0 to 10000 N·s/m, not 1e5.",
    "Time step: from 0.2 to 10 ms, not 50.",
    "Camera: position and target as six numbers of metres.",
  ]);
  for (const material of ["", "cube", "cube,1,2", ",2000,0.45,110", "cube,2000,0.5,110", "cube,0,0.45,110", "cube,2000,0.45,x", "cube,2000,,110", "cube,Infinity,0.45,110"]) {
    const read = readLink(`?material=${material}`);
    expect([material, read.link.materials, read.leftOut]).toEqual([material, [], ["Material: object, Young's modulus in Pa, Poisson's ratio from 0 to 0.499 and density in kg/m³."]]);
  }
  for (const camera of ["", "1,2,3,4,5,", "1,2,3,4,5,x", "1,2,3,1,2,3", "1,2,3,4,5,6,7", "NaN,0,0,0,0,0", "Infinity,0,0,0,0,0", "1e9,0,0,0,0,0"]) {
    expect([camera, readLink(`?camera=${camera}`).link.viewpoint]).toEqual([camera, null]);
  }
  expect(plain(readLink(`?gravity=${"9".repeat(500)}`).leftOut[0])).toBe("Gravity: from 0 to 100 m/s².");
});

test("the query keeps what is not of the link", () => {
  expect(withoutLink("?scene=a&ghost=off&gravity=3&friction=1&stiffness=1&damping=1&step_ms=1&material=a,1,0,1&material=b,1,0,1&camera=1,2,3,4,5,6")).toBe("?ghost=off");
  expect(withoutLink("?scene=a")).toBe("");
});

test("a start from a link opens its scene and changes what differs, once", () => {
  const query = "?scene=stack&gravity=3&friction=0.5&damping=2&camera=0,0,1,0,0,0";
  const { sent, told, ends, linked } = start(query, scene("ball"), scene("stack"), scene("stack", { gravity: [0, 0, -9.81] }));
  expect(sent).toEqual([{ type: "open_scene", scene: "stack" }, { type: "set_physics", gravity: [0, 0, -3], coupling: { stiffness: 200, damping: 2 } }]);
  expect([told, ends]).toEqual([[], 1]);
  expect(linked.takeViewpoint()).toEqual({ from: [0, 0, 1], to: [0, 0, 0] });
  expect(linked.takeViewpoint()).toBeNull();
});

test("materials follow one at a time, after the settings", () => {
  const query = "?scene=stack&gravity=3&material=cube,5000,0.3,200&material=small,%20round,8000,0.45,110&material=cube,1,0.45,110,";
  const { sent, told, ends } = start(query, scene("stack"), scene("stack"), scene("stack"), scene("stack"));
  expect(sent).toEqual([
    { type: "set_physics", gravity: [0, 0, -3] },
    { type: "set_material", object: 0, young: 5000, poisson: 0.3, density: 200 },
    { type: "set_material", object: 1, young: 8000, poisson: 0.45, density: 110 },
  ]);
  expect(told).toEqual(["Left out of the link: Material: object, Young's modulus in Pa, Poisson's ratio from 0 to 0.499 and density in kg/m³."]);
  expect(ends).toBe(1);
});

test("without a server Poisson's ratio stays, and what has no material is left out", () => {
  const query = "?material=cube,5000,0.3,200&material=small,%20round,5000,0.3,200&material=moon,5000,0.3,200";
  const { sent, told } = startWith(false, query, scene("stack", { materials: [JELLY, null] }), scene("stack"));
  expect(sent).toEqual([{ type: "set_material", object: 0, young: 5000, poisson: 0.45, density: 200 }]);
  expect(told).toEqual(['Left out of the link: Poisson\'s ratio of "cube": another one needs a recording. Material of "small, round": it cannot be changed here. Material of "moon": this scene has no such object.']);
});

test("a change that is refused ends the link", () => {
  const { sent, linked } = start("?gravity=3&material=cube,5000,0.3,200", scene("ball"));
  linked.refused();
  linked.scene(scene("ball"));
  expect(sent.length).toBe(1);
});

test("a start without a link sends nothing", () => {
  expect(start("?ghost=off", scene("ball"), scene("stack"))).toMatchObject({ sent: [], told: [], ends: 1 });
});

test("a scene that is not there leaves the whole link out", () => {
  const { sent, told, linked } = start("?scene=moon&gravity=3&camera=0,0,1,0,0,0", scene("ball"));
  expect([sent, told]).toEqual([[], ['The scene "moon" of the link is not here; the link was left out.']]);
  expect(linked.takeViewpoint()).toBeNull();
});

test("a scene that does not open is asked for once", () => {
  expect(start("?scene=stack&gravity=3", scene("ball"), scene("ball"), scene("ball")).sent).toEqual([{ type: "open_scene", scene: "stack" }]);
});

test("the user's choice of a scene ends the link", () => {
  const { sent, linked } = start("?scene=stack&gravity=3", scene("ball"));
  linked.end();
  linked.scene(scene("stack"));
  expect(sent.length).toBe(1);
});

test("a start says what it left out, and what the scene lacks", () => {
  const { sent, told } = start("?step_ms=99&stiffness=300&friction=1", scene("ball", { coupled: false }));
  expect(sent).toEqual([{ type: "set_physics", friction: 1 }]);
  expect(told).toEqual(["Left out of the link: Time step: from 0.2 to 10 ms, not 99. Coupling stiffness: this scene has none."]);
});

test("Reset goes back to the scene's own settings after a link", () => {
  const linked = scene("a", { own: OWN, gravity: [0, 0, -3], friction: 1 });
  expect(restoration(linked)).toEqual({ type: "set_physics", gravity: [0, 0, -9.81], friction: 0.5 });
  expect(queryOf(linkTo(linked, null))).toBe("?scene=a&gravity=3&friction=1");
});

test("an address for others holds no token, user or fragment", () => {
  expect(addressWith("https://me:secret@host.example/palpate/?token=abc&ghost=off#x", "?scene=a")).toBe("https://host.example/palpate/?scene=a");
});

test("a link from this computer, or to a server with a token, says so", () => {
  for (const [host, loopback] of [["localhost", true], ["127.0.0.1", true], ["127.9.8.7", true], ["[::1]", true], ["a.localhost", true], ["127.example.com", false], ["192.168.1.20", false], ["localhost.example", false]] as const) {
    expect([host, isLoopback(host)]).toEqual([host, loopback]);
  }
  expect(limitsOf("http://127.0.0.1:7400/", false)).toEqual(["127.0.0.1 is this computer: the link works on this computer only."]);
  expect(limitsOf("https://palpate.example/", false)).toEqual([]);
  expect(limitsOf("http://192.168.1.20:7400/", true).join()).toContain("token");
});

test("the HTML of a frame is escaped", () => {
  const html = frameHtml("https://a.example/?scene=a&gravity=3", 'palpate: "<b>&"');
  expect(html).toContain('src="https://a.example/?scene=a&amp;gravity=3" title="palpate: &quot;&lt;b&gt;&amp;&quot;"');
  expect(html).toMatch(/^<iframe [^<>]*><\/iframe>$/);
});

test("a viewpoint gives the same view in a wide and a narrow window", () => {
  const gravity: Vector = [0, -9.81, 0];
  const camera = (aspect: number) => {
    const orbit = new OrbitCamera();
    orbit.resize(aspect);
    orbit.setHome([0, 0.05, 0], 0.1, gravity, true);
    return orbit;
  };
  const [wide, phone] = [camera(1.8), camera(0.5)];
  expect(wide.isHome && phone.isHome).toBe(true);
  wide.rotate(0.3, 0.1);
  wide.zoom(0.8);
  wide.pan(0.1, -0.05);
  expect(wide.isHome).toBe(false);
  phone.look(wide.viewpoint);
  // The narrow view is farther away, by as much as at home.
  const distance = (orbit: OrbitCamera) => Math.hypot(...orbit.camera.position.toArray().map((x, k) => x - orbit.viewpoint.to[k]));
  expect(distance(phone) / distance(wide)).toBeGreaterThan(1.5);
  for (const end of ["from", "to"] as const) phone.viewpoint[end].forEach((x, k) => expect(x).toBeCloseTo(wide.viewpoint[end][k], 9));
  // Neither below the floor nor out of sight.
  phone.look({ from: [0, -1e5, 1], to: [0, 0.05, 0] });
  expect(phone.camera.position.y).toBeGreaterThan(0.05);
  expect(distance(phone)).toBeLessThan(60 * 0.1 + 1e-9);
});

test("films are named after their scene and day", () => {
  expect(filmName("stack", "webm", new Date(2026, 10, 6, 23, 59))).toBe("palpate-stack-2026-11-06.webm");
  expect(filmName("My Tüte / α", "mp4", new Date(2026, 0, 1))).toBe("palpate-my-tu-te-2026-01-01.mp4");
  expect(filmName("", "webm", new Date(2026, 0, 1))).toBe("palpate-2026-01-01.webm");
  expect([0, 9.99, 60, 179.2].map(clock)).toEqual(["0:00", "0:09", "1:00", "2:59"]);
});
