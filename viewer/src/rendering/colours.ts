// Colour palettes (sRGB) of the light and dark theme, and the colour map.

export type ColourMode = "plain" | "displacement" | "strain";

export interface Palette {
  background: string;
  ground: string;
  grid: string;
  shadow: number;
  obstacle: string;
  objects: readonly string[];
  wire: string;
  interfacePoint: string;
  proxy: string;
  text: string;
  halo: string;
  onObject: string;
  onDevice: string;
}

export const LIGHT: Palette = {
  background: "#eef1f4",
  ground: "#e3e8ec",
  grid: "#b4bec8",
  shadow: 0.42,
  obstacle: "#aab4be",
  objects: ["#e58a6b", "#5fa8a3", "#d7ac55", "#8f8bc9", "#9bb36a"],
  wire: "#4a3830",
  interfacePoint: "#2f6fd0",
  proxy: "#2f6fd0",
  text: "#1d2730",
  halo: "#ffffffd0",
  onObject: "#b3261e",
  onDevice: "#1f5fc4",
};

export const DARK: Palette = {
  background: "#14191e",
  ground: "#1b2228",
  grid: "#3c4853",
  shadow: 0.62,
  obstacle: "#65717c",
  objects: ["#e0835f", "#58a19c", "#cfa24a", "#8a86c8", "#91a95f"],
  wire: "#1d1512",
  interfacePoint: "#6fa8ff",
  proxy: "#6fa8ff",
  text: "#e6edf3",
  halo: "#0d1115d0",
  onObject: "#ff7a6e",
  onDevice: "#86b6ff",
};

// Sequential colour map with monotonic lightness, readable without hue.
export const RAMP: readonly string[] = ["#f4f0e6", "#f2dda6", "#eebd68", "#e2934c", "#ca653f", "#9d3f3e", "#64283a"];

export function rgb(colour: string): [number, number, number] {
  const bits = Number.parseInt(colour.slice(1, 7), 16);
  return [(bits >> 16) / 255, ((bits >> 8) & 255) / 255, (bits & 255) / 255];
}

export function rampNumbers(): Float32Array<ArrayBuffer> {
  return Float32Array.from(RAMP.flatMap(rgb));
}

export function isColourMode(name: string): name is ColourMode {
  return name === "plain" || name === "displacement" || name === "strain";
}
