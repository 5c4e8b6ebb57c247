// What a caller may say: a name mistyped would otherwise be a wish unheard.

import type { Until } from "./types.js";

/** Refuses what `Until` does not have: with a `TypeError` that names it. */
export function checkUntil(until: Until): void {
  checkNames("until", until, Object.keys(UNTIL));
  for (const [name, value] of Object.entries(until)) {
    const fits = UNTIL[name as keyof Until];
    if (value !== undefined && !fits(value)) throw new TypeError(`until.${name} cannot be ${String(value)}`);
  }
}

/** Refuses a member that is none of those known. */
export function checkNames(what: string, given: object, known: readonly string[]): void {
  const unknown = Object.keys(given).find((name) => !known.includes(name));
  if (unknown !== undefined) throw new TypeError(`${what} has no ${JSON.stringify(unknown)}: only ${known.join(", ")}`);
}

function isAmount(value: unknown): boolean {
  return typeof value === "number" && value >= 0;
}

/** What each member of `Until` may be. */
const UNTIL: { [name in keyof Required<Until>]: (value: unknown) => boolean } = {
  level: isAmount,
  error: isAmount,
  measure: (value) => value === "max" || value === "rms",
  triangles: isAmount,
  textures: isAmount,
};
