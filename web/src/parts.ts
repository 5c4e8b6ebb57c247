// Triangles part by part: the index and the groups of a geometry whose file has parts.

import type { Numbers } from "./unweld.js";
import { grown } from "./wedges.js";

/** Indices of one part. */
export interface Group {
  readonly part: number;
  readonly start: number;
  readonly count: number;
}

/** Triangles by number and their parts, where an index has them part by part. */
export class Parts {
  triangles = new Uint32Array(0);
  /** Of each triangle the place of its part among those that there are, in the order in which they came, and of each part how many it has. */
  #places = new Uint32Array(0);
  readonly #parts = new Map<number, number>();
  readonly #counts: number[] = [];

  /** Triangles from `first` on, where they end, are these, and of these parts. */
  append(first: number, indices: ArrayLike<number>, parts: Numbers): void {
    this.triangles = grown(this.triangles, 3 * first + indices.length);
    this.#places = grown(this.#places, first + parts.length);
    this.triangles.set(indices, 3 * first);
    for (let k = 0; k < parts.length; k++) this.#counts[(this.#places[first + k] = this.#place(parts[k]!))]!++;
  }

  /** Single triangles have others. */
  rewrite(triangles: Uint32Array, indices: Uint32Array, parts: Numbers): void {
    triangles.forEach((t, k) => {
      for (let c = 0; c < 3; c++) this.triangles[3 * t + c] = indices[3 * k + c]!;
      this.#counts[this.#places[t]!]!--;
      this.#counts[(this.#places[t] = this.#place(parts[k]!))]!++;
    });
  }

  /** Writes the first triangles, which are all, part by part, in ascending order, each part's in the order in which they are. */
  sort(count: number, into: { [at: number]: number }): Group[] {
    const groups: Group[] = [];
    const next: number[] = [];
    let start = 0;
    for (const [part, place] of [...this.#parts].sort(([a], [b]) => a - b)) {
      next[place] = start;
      const count = 3 * this.#counts[place]!;
      if (count > 0) groups.push({ part, start, count });
      start += count;
    }
    for (let t = 0; t < count; t++) {
      const place = this.#places[t]!;
      const to = next[place]!;
      for (let k = 0; k < 3; k++) into[to + k] = this.triangles[3 * t + k]!;
      next[place] = to + 3;
    }
    return groups;
  }

  #place(part: number): number {
    let place = this.#parts.get(part);
    if (place === undefined) {
      this.#parts.set(part, (place = this.#parts.size));
      this.#counts[place] = 0;
    }
    return place;
  }
}
