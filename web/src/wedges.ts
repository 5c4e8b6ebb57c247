// What a geometry by wedge keeps beside its buffers: which wedges a vertex has.

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

  /** The wedge of the same vertex that came before, or -1. */
  previous(wedge: number): number {
    return this.#before[wedge]! - 1;
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

/** The same numbers, with room for so many: twice as much as before where it does not suffice. */
export function grown(array: Uint32Array<ArrayBuffer>, length: number): Uint32Array<ArrayBuffer> {
  if (array.length >= length) return array;
  const larger = new Uint32Array(Math.max(length, 2 * array.length));
  larger.set(array);
  return larger;
}
