// What a geometry by wedge keeps beside its buffers: which wedges a vertex has.

import type { Numbers } from "./unweld.js";

/** Wedges by vertex. They are appended; each stays with its vertex. */
export class Wedges {
  count = 0;
  /** Those for which the file has no normal. */
  readonly bare = new Set<number>();
  /** The vertex of each. */
  #vertices = new Uint32Array(0);
  /** By vertex the wedge that came last, and by wedge the one before it of the same vertex; each more by 1, 0 for none. */
  #last = new Uint32Array(0);
  #before = new Uint32Array(0);

  append(vertices: Uint32Array): void {
    const first = this.count;
    this.count += vertices.length;
    this.#vertices = grown(this.#vertices, this.count);
    this.#before = grown(this.#before, this.count);
    this.#vertices.set(vertices, first);
    this.#last = grown(this.#last, vertices.reduce((most, v) => Math.max(most, v + 1), 0));
    for (let w = first; w < this.count; w++) {
      const v = this.#vertices[w]!;
      this.#before[w] = this.#last[v]!;
      this.#last[v] = w + 1;
    }
  }

  /** A wedge of a vertex, or -1. */
  any(v: number): number {
    return (this.#last[v] ?? 0) - 1;
  }

  vertex(wedge: number): number {
    return this.#vertices[wedge]!;
  }

  /** All wedges of some vertices, and for each the place of its vertex among them; `only` some of the wedges. */
  of(vertices: Uint32Array, only?: ReadonlySet<number>): { wedges: Uint32Array; places: Uint32Array } {
    const [wedges, places]: [number[], number[]] = [[], []];
    vertices.forEach((v, place) => {
      for (let w = this.any(v); w >= 0; w = this.#before[w]! - 1) {
        if (only && !only.has(w)) continue;
        wedges.push(w);
        places.push(place);
      }
    });
    return { wedges: Uint32Array.from(wedges), places: Uint32Array.from(places) };
  }
}

/** Whether the three corners of every triangle have the same normal. Equal normals of a source stay equal, however few bits they have. */
export function isFlat(normals: ArrayLike<number>, indices: ArrayLike<number>, triangles: number): boolean {
  const alike = (a: number, b: number) => [0, 1, 2].every((k) => normals[3 * a + k] === normals[3 * b + k]);
  for (let t = 0; t < triangles; t++) {
    const [a, b, c] = [indices[3 * t]!, indices[3 * t + 1]!, indices[3 * t + 2]!];
    if (!alike(a, b) || !alike(a, c)) return false;
  }
  return true;
}

/** Indices of one part. */
export interface Group {
  readonly part: number;
  readonly start: number;
  readonly count: number;
}

/** Triangles by number and their parts, where an index has them part by part. */
export class Parts {
  triangles = new Uint32Array(0);
  #numbers = new Float64Array(0);

  /** Triangles from `first` on are these, and of these parts. */
  append(first: number, indices: ArrayLike<number>, parts: Numbers): void {
    this.triangles = grown(this.triangles, 3 * first + indices.length);
    this.#numbers = grown(this.#numbers, first + parts.length);
    this.triangles.set(indices, 3 * first);
    this.#numbers.set(parts, first);
  }

  /** Single triangles have others. */
  rewrite(triangles: Uint32Array, indices: Uint32Array, parts: Numbers): void {
    triangles.forEach((t, k) => {
      for (let c = 0; c < 3; c++) this.triangles[3 * t + c] = indices[3 * k + c]!;
      this.#numbers[t] = parts[k]!;
    });
  }

  /** Writes the first triangles part by part, in ascending order, each part's in the order in which they are. */
  sort(count: number, into: { [at: number]: number }): Group[] {
    const counts = new Map<number, number>();
    for (let t = 0; t < count; t++) counts.set(this.#numbers[t]!, (counts.get(this.#numbers[t]!) ?? 0) + 1);
    const groups: Group[] = [];
    const next = new Map<number, number>();
    let start = 0;
    for (const [part, count] of [...counts].sort(([a], [b]) => a - b)) {
      groups.push({ part, start, count: 3 * count });
      next.set(part, start);
      start += 3 * count;
    }
    for (let t = 0; t < count; t++) {
      const part = this.#numbers[t]!;
      const to = next.get(part)!;
      for (let k = 0; k < 3; k++) into[to + k] = this.triangles[3 * t + k]!;
      next.set(part, to + 3);
    }
    return groups;
  }
}

/** The same numbers, with room for so many: twice as much as before where it does not suffice. */
function grown<T extends Uint32Array<ArrayBuffer> | Float64Array<ArrayBuffer>>(array: T, length: number): T {
  if (array.length >= length) return array;
  const larger = new (array.constructor as new (length: number) => T)(Math.max(length, 2 * array.length));
  larger.set(array);
  return larger;
}
