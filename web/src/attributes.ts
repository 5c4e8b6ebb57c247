// Attributes of the file, from the bytes that the module tells.

import type { Attributes, FileAttribute, NumberType, Numbers } from "./types.js";

/** The values by name, of so many wedges and triangles: cut out of the bytes in which they lie one after the other. */
export function valuesOf(
  attributes: readonly FileAttribute[],
  bytes: Uint8Array,
  { wedges, triangles }: { wedges: number; triangles: number },
): Attributes["values"] {
  let at = 0;
  const values = attributes.map(({ name, domain, components, type }): [string, Numbers] => {
    const array = ARRAYS[type];
    const end = at + components * (domain === "corner" ? wedges : triangles) * array.BYTES_PER_ELEMENT;
    // A buffer of its own: it may be handed on.
    const { buffer } = bytes.slice(at, end);
    at = Math.ceil(end / ALIGNED) * ALIGNED;
    return [name, new array(buffer)];
  });
  return Object.fromEntries(values);
}

/** The arrays of numbers by the names of their types. */
const ARRAYS = {
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
