// A geometry's buffers by wedge: what the attributes of a file make of those by vertex.

import { BufferAttribute } from "three";
import type { Attributes, FileAttribute, Numbers } from "./unweld.js";

/** Buffers by wedge. */
export interface Dress {
  readonly attributes: Readonly<Record<string, BufferAttribute>>;
  readonly index: BufferAttribute;
  readonly groups: readonly Group[];
  /** Whether the file's normals are those of the triangles. */
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
  const at = gathered(position, vertices);
  const attributes: Dress["attributes"] = { position: new BufferAttribute(at, 3), normal: new BufferAttribute(gathered(normal, vertices), 3) };
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
    flat: normals !== undefined && isFlat(at, normals, indices),
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

/** Whether the normals at the corners of every triangle that has an area are its own. */
function isFlat(position: Float32Array, normals: Numbers, indices: Uint32Array): boolean {
  const own = [0, 0, 0];
  const edge = (from: number, to: number, k: number) => position[3 * to + k]! - position[3 * from + k]!;
  for (let t = 0; t < indices.length; t += 3) {
    const [a, b, c] = [indices[t]!, indices[t + 1]!, indices[t + 2]!];
    for (let k = 0; k < 3; k++) {
      const [l, m] = [(k + 1) % 3, (k + 2) % 3];
      own[k] = edge(a, b, l) * edge(a, c, m) - edge(a, b, m) * edge(a, c, l);
    }
    const length = Math.hypot(own[0]!, own[1]!, own[2]!);
    if (length === 0) continue;
    for (const wedge of [a, b, c]) {
      const [x, y, z] = [normals[3 * wedge]!, normals[3 * wedge + 1]!, normals[3 * wedge + 2]!];
      if (x * own[0]! + y * own[1]! + z * own[2]! < ALIKE * length * Math.hypot(x, y, z)) return false;
    }
  }
  return indices.length > 0;
}

/** The cosine of one degree: normals of 10 bits are a tenth of it off, those of a surface of 100 edges a turn three times as much. */
const ALIKE = Math.cos(Math.PI / 180);
