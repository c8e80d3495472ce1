// QR code of a text, as an SVG image: dark on light in both themes, as readers expect.

import { encode } from "uqr";

/** Light modules on each side that the standard asks for (ISO/IEC 18004). */
const QUIET_ZONE = 4;

/** Longest text that a code holds at level M [bytes]. */
const MAX_BYTES = 2331;

/** QR code with error correction of level M or better; null if the text is too long. */
export function qrCode(text: string, label: string): SVGSVGElement | null {
  if (new TextEncoder().encode(text).length > MAX_BYTES) return null;
  const { data, size } = encode(text, { ecc: "M", boostEcc: true, border: QUIET_ZONE });
  const svg = create("svg", { class: "qr-code", viewBox: `0 0 ${size} ${size}`, role: "img", "aria-label": label, "shape-rendering": "crispEdges" });
  const dark = data.flatMap((row, y) => row.flatMap((isDark, x) => (isDark ? [`M${x} ${y}h1v1h-1z`] : [])));
  svg.append(create("rect", { width: String(size), height: String(size), class: "light" }), create("path", { d: dark.join(""), class: "dark" }));
  return svg;
}

function create<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Record<string, string>): SVGElementTagNameMap[K] {
  const created = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) created.setAttribute(name, value);
  return created;
}
