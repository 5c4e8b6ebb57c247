// Attributes of the file, from the bytes that the module tells.

import type { Changes } from "./module.js";
import type { Attributes, FileAttribute, NumberType, Numbers } from "./types.js";

/** What is new of the attributes that are alive; `null` where nothing is. */
export function attributesOf(file: readonly FileAttribute[], changes: Changes): Attributes | null {
  const { wedges: vertices, wedgeIndices: indices, rewrittenWedges, firstTold: firstTriangle, firstWedge } = changes;
  if (changes.alive.length === 0) return null;
  const alive = Array.from(changes.alive, (k) => file[k]!);
  const told = changes.triangles - firstTriangle;
  const rewritten = firstTriangle === 0 ? 0 : changes.rewritten.length;
  const values: Record<string, Numbers> = {};
  const others: Record<string, Numbers> = {};
  let at = 0;
  const cut = ({ components, type }: FileAttribute, count: number): Numbers => {
    const array = ARRAYS[type];
    const end = at + components * count * array.BYTES_PER_ELEMENT;
    // A buffer of its own: it may be handed on.
    const { buffer } = changes.values.slice(at, end);
    at = end;
    return new array(buffer);
  };
  for (const attribute of alive) {
    const { name, domain } = attribute;
    values[name] = cut(attribute, domain === "corner" ? vertices.length : told);
    if (domain === "triangle") others[name] = cut(attribute, rewritten);
    at = Math.ceil(at / ALIGNED) * ALIGNED;
  }
  const names = alive.map(({ name }) => name);
  return { alive: names, firstTriangle, firstWedge, vertices, indices, values, rewritten: { indices: rewrittenWedges, values: others } };
}

/** The arrays of numbers by the names of their types. */
export const ARRAYS = {
  u8: Uint8Array,
  i8: Int8Array,
  u16: Uint16Array,
  i16: Int16Array,
  u32: Uint32Array,
  i32: Int32Array,
  f32: Float32Array,
} satisfies Record<NumberType, new (buffer: ArrayBuffer) => Numbers>;
/** Where values begin: at multiples of so many bytes. */
const ALIGNED = 4;
