// A geometry's buffers by wedge: what the attributes of a file make of those by vertex.

import { BufferAttribute } from "three";
import type { Attributes, FileAttribute, Numbers } from "./unweld.js";

/** Buffers by wedge. */
export interface Dress {
  readonly attributes: Readonly<Record<string, BufferAttribute>>;
  readonly index: BufferAttribute;
  readonly groups: readonly Group[];
  /** Whether the file has normals, and one for each triangle. */
  readonly flat: boolean;
}

/** Indices of one part. */
export interface Group {
  readonly part: number;
  readonly start: number;
  readonly count: number;
}

/** The buffers of a mesh whose vertices have these positions and normals. */
export function dressOf(
  { vertices, indices, values }: Attributes,
  file: readonly FileAttribute[],
  position: ArrayLike<number>,
  normal: ArrayLike<number>,
): Dress {
  const byVertex = Object.entries({ position, normal }).map(([name, values]) => [name, new BufferAttribute(gathered(values, vertices), 3)] as const);
  const attributes: Dress["attributes"] = Object.fromEntries(byVertex);
  const own = file.flatMap(({ name, domain, components, normalised }): [string, BufferAttribute][] =>
    domain === "corner" ? [[name, new BufferAttribute(values[name]!, components, normalised)]] : [],
  );
  const told = file.find(({ name, semantic, components }) => name === "normal" && semantic === "normal" && components === 3);
  const normals = told && values[told.name];
  if (normals instanceof Float32Array) complete(normals, attributes.normal!.array);
  const part = file.find(({ semantic, domain, components }) => semantic === "part" && domain === "triangle" && components === 1);
  const [index, groups] = part ? byPart(indices, values[part.name]!) : [indices, []];
  return {
    attributes: { ...attributes, ...Object.fromEntries(own) },
    index: new BufferAttribute(index, 1),
    groups,
    flat: normals !== undefined && isFlat(normals, indices),
  };
}

/** Three numbers of the vertex of each wedge. */
function gathered(values: ArrayLike<number>, vertices: Uint32Array): Float32Array {
  const array = new Float32Array(3 * vertices.length);
  vertices.forEach((v, wedge) => {
    for (let k = 0; k < 3; k++) array[3 * wedge + k] = values[3 * v + k]!;
  });
  return array;
}

/** Where the file has no normal, it is the one of the vertex. */
function complete(normals: Float32Array, others: ArrayLike<number>): void {
  for (let at = 0; at < normals.length; at += 3) {
    if (normals[at] || normals[at + 1] || normals[at + 2]) continue;
    for (let k = 0; k < 3; k++) normals[at + k] = others[at + k]!;
  }
}

/** The triangles part by part, in ascending order, each part's in the order in which they were. */
function byPart(indices: Uint32Array, parts: Numbers): [indices: Uint32Array, groups: Group[]] {
  const counts = new Map<number, number>();
  for (const part of parts) counts.set(part, (counts.get(part) ?? 0) + 1);
  const groups: Group[] = [];
  const next = new Map<number, number>();
  let start = 0;
  for (const [part, count] of [...counts].sort(([a], [b]) => a - b)) {
    groups.push({ part, start, count: 3 * count });
    next.set(part, start);
    start += 3 * count;
  }
  const sorted = new Uint32Array(indices.length);
  parts.forEach((part, t) => {
    const to = next.get(part)!;
    for (let k = 0; k < 3; k++) sorted[to + k] = indices[3 * t + k]!;
    next.set(part, to + 3);
  });
  return [sorted, groups];
}

/** Whether the three corners of every triangle have the same normal. Equal normals of a source stay equal, however few bits they have. */
function isFlat(normals: Numbers, indices: Uint32Array): boolean {
  const alike = (a: number, b: number) => [0, 1, 2].every((k) => normals[3 * a + k] === normals[3 * b + k]);
  for (let t = 0; t < indices.length; t += 3) {
    const [a, b, c] = [indices[t]!, indices[t + 1]!, indices[t + 2]!];
    if (!alike(a, b) || !alike(a, c)) return false;
  }
  return true;
}
