// Scene files of objects: the part of TOML that scenes need.

/** Value of a scene's key. */
export type TomlValue = string | number | boolean | readonly TomlValue[] | { readonly [key: string]: TomlValue | undefined };

/** TOML of a table of values and of lists of tables, as `[[object]]`. */
export function toToml(table: { readonly [key: string]: TomlValue | readonly { readonly [key: string]: TomlValue | undefined }[] | undefined }): string {
  const lines: string[] = [];
  const lists: string[] = [];
  for (const [key, value] of Object.entries(table)) {
    if (value === undefined) continue;
    if (isListOfTables(value)) {
      for (const entry of value) lists.push(`\n[[${key}]]`, ...rows(entry));
    } else {
      lines.push(`${key} = ${inline(value as TomlValue)}`);
    }
  }
  return [...lines, ...lists, ""].join("\n");
}

function isTable(value: unknown): value is { readonly [key: string]: TomlValue | undefined } {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function isListOfTables(value: unknown): value is readonly { readonly [key: string]: TomlValue | undefined }[] {
  return Array.isArray(value) && value.length > 0 && value.every(isTable);
}

function rows(table: { readonly [key: string]: TomlValue | undefined }): string[] {
  return Object.entries(table)
    .filter(([, value]) => value !== undefined)
    .map(([key, value]) => `${key} = ${inline(value as TomlValue)}`);
}

function inline(value: TomlValue): string {
  if (typeof value === "string") return JSON.stringify(value);
  if (typeof value === "boolean") return String(value);
  if (typeof value === "number") return number(value);
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return `[${Array.from(value as readonly TomlValue[], inline).join(", ")}]`;
  return `{ ${rows(value as { readonly [key: string]: TomlValue | undefined }).join(", ")} }`;
}

/** Number in TOML: a whole number is one as it stands, since a scene reads it as either. */
function number(value: number): string {
  if (Number.isNaN(value)) return "nan";
  if (!Number.isFinite(value)) return value > 0 ? "inf" : "-inf";
  // Whole numbers beyond those of TOML are written as fractions.
  return Number.isInteger(value) && !Number.isSafeInteger(value) ? value.toExponential() : String(value);
}
