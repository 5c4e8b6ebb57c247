// Arrays that have room for more than is in use, and what of them is sent to the graphics card.

import { BufferAttribute, type TypedArray } from "three";
import type { Numbers } from "./types.js";

/**
 * An attribute for so many numbers, with room for as many as there may be (`most`), if that is but a few times what there is now, for no header's claim
 * shall cost memory: the old one, where it has room. Tells whether it is a new one, which is sent as a whole.
 */
export function roomy(
  old: BufferAttribute | null,
  type: new (length: number) => Numbers,
  size: number,
  numbers: number,
  most: { readonly numbers: number; readonly least: number },
  normalised = false,
): [attribute: BufferAttribute, fresh: boolean] {
  const fits = old?.array instanceof type ? old : null;
  if (fits && fits.array.length >= numbers) return [counted(fits, numbers), false];
  const array = new type(Math.max(numbers, Math.min(most.numbers, Math.max(most.least, GROWTH * numbers))));
  if (fits) array.set(fits.array);
  return [counted(new BufferAttribute(array, size, normalised), numbers), true];
}

/**
 * Tells an attribute how many of its numbers are in use. The renderer sends whole arrays; whatever else reads a geometry, such as bounding boxes and
 * exporters, goes by the count.
 */
export function counted(attribute: BufferAttribute, numbers: number): BufferAttribute {
  return Object.assign(attribute, { count: numbers / attribute.itemSize });
}

/** Numbers of single items. */
export function scatter(array: TypedArray, components: number, places: Uint32Array, values: ArrayLike<number>): void {
  for (let k = 0; k < places.length; k++) {
    const to = components * places[k]!;
    for (let c = 0; c < components; c++) array[to + c] = values[components * k + c]!;
  }
}

/** Marks what has to be sent: items from `first` to `end`, and the blocks that `places` lie in. */
export function upload(attribute: BufferAttribute, size: number, first: number, end: number, places?: ArrayLike<number>): void {
  const add = (from: number, to: number) => attribute.addUpdateRange(from * size, (to - from) * size);
  if (places?.length) {
    const blocks = new Uint8Array(Math.ceil(first / BLOCK));
    for (let k = 0; k < places.length; k++) blocks[Math.floor(places[k]! / BLOCK)] = 1;
    for (let from = blocks.indexOf(1); from >= 0; ) {
      let [to, next] = [from + 1, blocks.indexOf(1, from + 1)];
      for (; next >= 0 && next - to < NEAR; next = blocks.indexOf(1, to)) to = next + 1;
      add(from * BLOCK, Math.min(to * BLOCK, first));
      from = next;
    }
  }
  if (end > first) add(first, end);
  attribute.needsUpdate = true;
}

/** How many times the room grows. */
const GROWTH = 4;
/** Items that are sent together if one of them has changed: a call costs as much as some kilobytes. */
const BLOCK = 512;
/** Blocks between two that are sent with them. */
const NEAR = 4;
