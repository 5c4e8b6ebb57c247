// The geometries of a scene: one a part, out of the one mesh that a file holds for all.

import { Buffers, PartGeometry, type Fresh, type PartOf } from "./buffers.js";
import type { Delta, Numbers } from "./unweld.js";
import { grown, Wedges } from "./wedges.js";

/** What is new in a delta, whether the file's buffers are by wedge or by vertex. */
interface Told extends Fresh {
  /** Whether everything is new. */
  readonly anew: boolean;
  readonly firstTriangle: number;
  /** Three wedges a triangle, and the part of each. */
  readonly indices: Uint32Array;
  readonly parts: Numbers | null;
  readonly rewritten: { readonly triangles: Uint32Array; readonly indices: Uint32Array; readonly parts: Numbers | null };
}

/**
 * All parts of a scene. Vertex buffers are shared by the parts that have the same attributes; those with a skin or morph targets have their own. An
 * index is the part's. The mesh of the file has its positions times 2^k, k a number of each part: the geometries have them as the scene means them.
 */
export class Layout {
  /** By number of the part; parts that no primitive shows have none. */
  readonly geometries = new Map<number, PartGeometry>();
  /** Bytes of all buffers. */
  get bytes(): number {
    return [...this.#buffers.reduce((all, buffers) => buffers.arrays(all), new Set<ArrayBufferView>())].reduce((sum, { byteLength }) => sum + byteLength, 0);
  }
  readonly #morph: boolean;
  /** Whether positions are told relative to the smallest corner of the bounding box. */
  readonly #relative: boolean;
  readonly #buffers: Buffers[] = [];
  readonly #parts: (PartOf | undefined)[] = [];
  #wedges = new Wedges();
  /** By wedge: its place in the buffers that have it first, more by 1, and which these are; then other buffers that have it, too. */
  #slots = new Uint32Array(0);
  #homes = new Uint32Array(0);
  #others = new Map<number, number>();
  /** By vertex the exponent. */
  #exponents = new Uint32Array(0);
  /** By triangle its part, more by 1, and its place in the part's index. */
  #partOf = new Uint32Array(0);
  #placeOf = new Uint32Array(0);

  constructor(parts: readonly PartOf["spec"][], { morph, relative }: { morph: boolean; relative: boolean }) {
    this.#morph = morph;
    this.#relative = relative;
    const shared = new Map<string, Buffers>();
    for (const spec of parts) {
      const names = Object.entries(spec.attributes).map(([name, { type }]) => `${name} ${type}`);
      const key = spec.alone ? `part ${spec.part}` : names.sort().join();
      let buffers = shared.get(key);
      if (!buffers) {
        buffers = new Buffers(this.#buffers.length, spec, morph);
        shared.set(key, buffers);
        this.#buffers.push(buffers);
      }
      const part: PartOf = { spec, buffers, geometry: new PartGeometry(), count: 0, triangles: new Uint32Array(0), changed: [] };
      buffers.geometries.push(part.geometry);
      this.#parts[spec.part] = part;
      this.geometries.set(spec.part, part.geometry);
    }
  }

  /** Applies what has changed; `time` is when new vertices are born. */
  apply(moved: Delta, time: number): void {
    const delta = this.#relative ? absolute(moved) : moved;
    const told = this.#told(delta, time);
    const triangles = told.firstTriangle + told.indices.length / 3;
    if (told.anew) this.#clear();
    for (const buffers of this.#buffers) buffers.begin(delta.contents.fileAttributes, delta.attributes?.alive ?? null, told.anew);
    this.#move(told.anew ? null : delta);
    this.#wedges.append(told.vertices);
    this.#slots = grown(this.#slots, this.#wedges.count);
    this.#homes = grown(this.#homes, this.#wedges.count);
    this.#exponents = grown(this.#exponents, delta.vertices);
    this.#partOf = grown(this.#partOf, triangles);
    this.#placeOf = grown(this.#placeOf, triangles);
    // Places first, of triangles and of wedges; then the buffers, which know by then how large they are.
    const { rewritten } = told;
    rewritten.triangles.forEach((t, k) => this.#settle(t, rewritten.parts?.[k] ?? 0, rewritten.indices, 3 * k));
    for (let k = 0; k < told.indices.length; k += 3) {
      const t = told.firstTriangle + k / 3;
      this.#settle(t, told.parts?.[k / 3] ?? 0, told.indices, k);
    }
    const share = Math.max(1, delta.contents.wanted.triangles / Math.max(1, delta.triangles));
    for (const buffers of this.#buffers) this.#fill(buffers, told, share);
    rewritten.triangles.forEach((t, k) => this.#connect(t, rewritten.indices, 3 * k, share));
    for (let k = 0; k < told.indices.length; k += 3) this.#connect(told.firstTriangle + k / 3, told.indices, k, share);
    const error = (delta.level ?? delta.contents.levels.at(-1))?.maxError ?? 0;
    const ended = { anew: told.anew, level: delta.levels.length > 0, last: delta.complete || delta.levels.some(({ level }) => level === 0) };
    for (const part of this.#parts) part?.geometry.end(part, error, ended);
    for (const buffers of this.#buffers) buffers.end();
  }

  /** Ends all buffers. */
  dispose(): void {
    for (const geometry of this.geometries.values()) geometry.dispose();
  }

  #told(delta: Delta, time: number): Told {
    const { attributes, contents, firstVertex, vertices } = delta;
    const alive = attributes ? contents.fileAttributes.filter(({ name }) => attributes.alive.includes(name)) : [];
    const part = alive.find(({ semantic, domain, components }) => semantic === "part" && domain === "triangle" && components === 1);
    const [byWedge, born] = [alive.some(({ domain }) => domain === "corner"), attributes?.firstTriangle === 0 && firstVertex > 0];
    const values = attributes?.values ?? {};
    const known = born ? this.#vertices(delta, time) : delta;
    const first = born ? 0 : firstVertex;
    const positions = {
      firstVertex: first,
      position: known.appended.position!,
      normal: known.appended.normal!,
      from: known.from,
      born: "born" in known ? (known.born as Float32Array) : null,
      time: firstVertex > 0 ? time : -LONG_AGO,
      values,
    };
    const anew = first === 0;
    const parts = part ? { told: values[part.name]!, rewritten: attributes!.rewritten.values[part.name] ?? null } : { told: null, rewritten: null };
    const nothing = { triangles: NONE, indices: NONE, parts: null };
    if (!byWedge) {
      const own = Uint32Array.from({ length: vertices - first }, (_, k) => first + k);
      const whole = born ? this.#triangles(delta) : delta.indices;
      const rewritten = anew ? nothing : { ...delta.rewritten, parts: parts.rewritten };
      return { ...positions, anew, firstWedge: first, vertices: own, firstTriangle: anew ? 0 : delta.firstTriangle, indices: whole, parts: parts.told, rewritten };
    }
    const { firstTriangle, firstWedge, indices, rewritten } = attributes!;
    const others = anew ? nothing : { triangles: delta.rewritten.triangles, indices: rewritten.indices, parts: parts.rewritten };
    return { ...positions, anew, firstWedge, vertices: attributes!.vertices, firstTriangle, indices, parts: parts.told, rewritten: others };
  }

  /** All vertices as they are after a delta, where attributes are born with it: what was there is looked up in the buffers. */
  #vertices(delta: Delta, time: number): Pick<Delta, "appended" | "from"> & { born: Float32Array } {
    const { firstVertex, vertices } = delta;
    const [position, normal, from] = [0, 1, 2].map(() => new Float32Array(3 * vertices)) as [Float32Array, Float32Array, Float32Array];
    const born = new Float32Array(vertices).fill(time, firstVertex);
    for (let v = 0; v < firstVertex; v++) {
      const w = this.#wedges.any(v);
      const slot = w < 0 ? 0 : this.#slots[w]!;
      if (slot === 0) continue;
      const buffers = this.#buffers[this.#homes[w]!]!;
      const scale = 2 ** (this.#exponents[v]! - BIAS);
      buffers.read("position", slot - 1, position, v, scale);
      buffers.read("normal", slot - 1, normal, v, 1);
      if (!this.#morph) continue;
      buffers.read("from", slot - 1, from, v, scale);
      buffers.read("born", slot - 1, born, v, 1);
    }
    position.set(delta.appended.position!, 3 * firstVertex);
    normal.set(delta.appended.normal!, 3 * firstVertex);
    from.set(delta.from, 3 * firstVertex);
    for (const [array, { vertices, values }] of [[position, delta.changed.position!], [normal, delta.changed.normal!]] as const) {
      vertices.forEach((v, k) => array.set(values.subarray(3 * k, 3 * k + 3), 3 * v));
    }
    return { appended: { position, normal }, from, born };
  }

  /** All triangles after a delta with which attributes of triangles are born, where buffers are by vertex. */
  #triangles(delta: Delta): Uint32Array {
    const all = new Uint32Array(3 * delta.triangles);
    for (let t = 0; t < delta.firstTriangle; t++) {
      const part = this.#parts[this.#partOf[t]! - 1];
      if (!part) continue;
      const index = part.geometry.index!.array;
      const from = 3 * this.#placeOf[t]!;
      for (let c = 0; c < 3; c++) all[3 * t + c] = part.buffers.wedge(index[from + c]!);
    }
    all.set(delta.indices, 3 * delta.firstTriangle);
    delta.rewritten.triangles.forEach((t, k) => all.set(delta.rewritten.indices.subarray(3 * k, 3 * k + 3), 3 * t));
    return all;
  }

  #clear(): void {
    this.#wedges = new Wedges();
    this.#slots.fill(0);
    this.#partOf.fill(0);
    this.#others.clear();
    for (const part of this.#parts) if (part) part.count = 0;
  }

  /** What vertices have that were there: at all their wedges. */
  #move(delta: Delta | null): void {
    if (!delta) return;
    for (const name of ["position", "normal"] as const) {
      const { vertices, values } = delta.changed[name] ?? { vertices: NONE, values: new Float32Array(0) };
      const { wedges, places } = this.#wedges.of(vertices);
      for (let k = 0; k < wedges.length; k++) {
        const [w, place] = [wedges[k]!, places[k]!];
        const scale = name === "position" ? 2 ** (BIAS - this.#exponents[vertices[place]!]!) : 1;
        if (this.#slots[w]!) this.#buffers[this.#homes[w]!]!.move(name, this.#slots[w]! - 1, values, place, scale);
        if (this.#others.size === 0) continue;
        for (const buffers of this.#buffers) {
          const slot = this.#others.get(w * this.#buffers.length + buffers.number);
          if (slot !== undefined) buffers.move(name, slot, values, place, scale);
        }
      }
    }
  }

  /** Gives a triangle its place in its part, and its wedges theirs in the part's buffers. */
  #settle(t: number, number: number, indices: Uint32Array, at: number): void {
    const part = this.#parts[number];
    const old = this.#parts[this.#partOf[t]! - 1];
    if (old !== part || !part) {
      if (old) this.#leave(t, old);
      this.#partOf[t] = part ? number + 1 : 0;
      if (!part) return;
      this.#placeOf[t] = part.count;
      part.triangles = grown(part.triangles, ++part.count);
      part.triangles[part.count - 1] = t;
    }
    for (let c = 0; c < 3; c++) {
      const w = indices[at + c]!;
      this.#exponents[this.#wedges.vertex(w)] = part.spec.exponent + BIAS;
      if (this.#slots[w] === 0) {
        this.#slots[w] = part.buffers.add(w) + 1;
        this.#homes[w] = part.buffers.number;
      } else if (this.#homes[w] !== part.buffers.number) {
        const key = w * this.#buffers.length + part.buffers.number;
        if (!this.#others.has(key)) this.#others.set(key, part.buffers.add(w));
      }
    }
  }

  /** Takes a triangle out of a part: the last one takes its place. */
  #leave(t: number, part: PartOf): void {
    const [place, last] = [this.#placeOf[t]!, --part.count];
    const other = part.triangles[last]!;
    part.triangles[place] = other;
    this.#placeOf[other] = place;
    const index = part.geometry.index?.array;
    if (!index || 3 * last >= index.length) return;
    for (let c = 0; c < 3; c++) index[3 * place + c] = index[3 * last + c]!;
    part.changed.push(place);
  }

  #fill(buffers: Buffers, told: Told, share: number): void {
    buffers.fill(told, share, {
      vertex: (w) => this.#wedges.vertex(w),
      scale: (v) => 2 ** (BIAS - this.#exponents[v]!),
      // A wedge of the same vertex that was there: where it is.
      sibling: (v, isThere) => {
        for (let w = this.#wedges.any(v); w >= 0; w = this.#wedges.previous(w)) {
          const [slot, home] = [this.#slots[w]! - 1, this.#buffers[this.#homes[w]!]!];
          if (slot >= 0 && isThere(home, slot)) return [home, slot];
        }
        return null;
      },
      home: (w) => [this.#buffers[this.#homes[w]!]!, this.#slots[w]! - 1],
    });
  }

  #connect(t: number, indices: Uint32Array, at: number, share: number): void {
    const part = this.#parts[this.#partOf[t]! - 1];
    if (!part) return;
    const { buffers, geometry } = part;
    const index = geometry.room(part.count, share);
    const place = this.#placeOf[t]!;
    for (let c = 0; c < 3; c++) {
      const w = indices[at + c]!;
      const slot = this.#homes[w] === buffers.number ? this.#slots[w]! - 1 : this.#others.get(w * this.#buffers.length + buffers.number)!;
      index[3 * place + c] = slot;
      geometry.reach(buffers, slot);
    }
    part.changed.push(place);
  }
}

/** A delta whose positions are relative, with those that the file means. */
function absolute(delta: Delta): Delta {
  const { min } = delta.contents;
  const moved = (values: Float32Array) => values.map((x, k) => x + min[k % 3]!);
  const { position, ...changed } = delta.changed;
  return {
    ...delta,
    appended: { ...delta.appended, position: moved(delta.appended.position!) },
    changed: { ...changed, position: { vertices: position!.vertices, values: moved(position!.values) } },
    from: moved(delta.from),
  };
}

/** Added to exponents, which are from -60 to 60. */
const BIAS = 64;
/** Seconds: vertices born then are in their places. */
const LONG_AGO = 1e6;
const NONE = new Uint32Array(0);
