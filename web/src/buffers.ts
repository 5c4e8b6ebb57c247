// Vertex buffers that parts of a scene share, and the geometry of a part.

import { Box3, BufferAttribute, BufferGeometry, Sphere, Vector3 } from "three";
import { ARRAYS } from "./attributes.js";
import { componentsOf } from "./document.js";
import { counted, roomy, upload } from "./room.js";
import type { FileAttribute, Numbers } from "./types.js";
import { grown } from "./wedges.js";

/** How glTF describes an accessor. */
export interface Kind {
  readonly componentType: number;
  readonly type: string;
  readonly normalized?: boolean;
}

/** A part as a primitive tells it. */
export interface PartSpec {
  readonly part: number;
  readonly exponent: number;
  readonly attributes: Readonly<Record<string, Kind>>;
  readonly targets: readonly Readonly<Record<string, Kind>>[];
  /** Whether its buffers are its own. */
  readonly alone: boolean;
}

/** A part and its triangles: how many, which, and the places that have changed. */
export interface PartOf {
  readonly spec: PartSpec;
  readonly buffers: Buffers;
  readonly geometry: PartGeometry;
  count: number;
  triangles: Uint32Array<ArrayBuffer>;
  changed: number[];
}

/** What is new of vertices and wedges. */
export interface Fresh {
  readonly firstVertex: number;
  readonly position: Float32Array;
  readonly normal: Float32Array;
  readonly from: Float32Array;
  /** When the vertices were born; `null`: at `time`, all of them. */
  readonly born: Float32Array | null;
  readonly time: number;
  readonly firstWedge: number;
  /** The vertices of the wedges. */
  readonly vertices: Uint32Array;
  readonly values: Readonly<Record<string, Numbers>>;
}

/** Where wedges are. */
interface Places {
  vertex(wedge: number): number;
  scale(vertex: number): number;
  sibling(vertex: number, isThere: (buffers: Buffers, slot: number) => boolean): [Buffers, number] | null;
  home(wedge: number): [Buffers, number];
}

/** An attribute: of all meshes, or of the file under the name that it has there. */
interface Column {
  readonly name: string;
  readonly components: number;
  /** What it is called in glTF; empty for what all meshes have. */
  readonly source: string;
  /** What stands in its place while it has no values. */
  readonly stand: readonly number[] | null;
  /** For a morph target: which, and what of it. */
  readonly target: readonly [number, string] | null;
  file: FileAttribute | null;
  attribute: BufferAttribute | null;
}

/** The wedges added, from `first` on: their vertices, and where a wedge of each was, if one was. */
interface Old {
  readonly first: number;
  readonly vertices: Uint32Array;
  readonly slots: Int32Array;
  readonly homes: Buffers[];
}

/** Vertices of parts that have the same attributes. */
export class Buffers {
  readonly geometries: PartGeometry[] = [];
  readonly number: number;
  count = 0;
  readonly #columns: Column[];
  readonly #targets: number;
  #wedges = new Uint32Array(0);
  /** Those that have their values, and those of these that have others now. */
  #filled = 0;
  #moved = new Map<Column, number[]>();
  #bare = new Set<number>();
  #fresh = new Set<Column>();
  /** Whether there are other attributes than before. */
  #isOther = false;

  constructor(number: number, { attributes, targets }: PartSpec, morph: boolean) {
    this.number = number;
    this.#targets = targets.length;
    this.#columns = [column("position", 3, "")];
    if (morph) this.#columns.push(column("from", 3, ""), column("born", 1, ""));
    for (const [name, { type }] of Object.entries(attributes)) {
      if (name !== "POSITION") this.#columns.push(column(nameOf(name), componentsOf(type), name));
    }
    for (const of of ["POSITION", "NORMAL", "COLOR_0"]) {
      const kind = targets.map((target) => target[of]).find((kind) => kind !== undefined);
      if (!kind) continue;
      // All targets or none: three.js knows nothing between.
      targets.forEach((_, t) => this.#columns.push(column(`${t} ${of}`, componentsOf(kind.type), `TARGET${t}_${of}`, [t, nameOf(of)])));
    }
  }

  arrays(into: Set<ArrayBufferView>): Set<ArrayBufferView> {
    for (const { attribute } of this.#columns) if (attribute) into.add(attribute.array);
    for (const { index } of this.geometries) if (index) into.add(index.array);
    return into;
  }

  /** Before a delta: what the file has of the attributes that are alive; `null` where nothing is said of them. */
  begin(file: readonly FileAttribute[], alive: readonly string[] | null, anew: boolean): void {
    if (anew) {
      this.count = this.#filled = 0;
      this.#bare.clear();
    }
    if (!alive && !anew) return;
    for (const column of this.#columns) {
      const before = column.file;
      column.file = column.source ? (file.find((one) => alive?.includes(one.name) && isMeant(one, column.source)) ?? null) : null;
      this.#isOther ||= (before === null) !== (column.file === null);
    }
  }

  /** A place for a wedge. */
  add(wedge: number): number {
    this.#wedges = grown(this.#wedges, this.count + 1);
    this.#wedges[this.count] = wedge;
    return this.count++;
  }

  wedge(slot: number): number {
    return this.#wedges[slot]!;
  }

  read(name: string, slot: number, into: Float32Array, item: number, scale: number): void {
    const column = this.#columns.find((column) => column.name === name);
    if (!column?.attribute || slot >= this.#filled) return;
    const { array, itemSize } = column.attribute;
    for (let c = 0; c < itemSize; c++) into[itemSize * item + c] = array[itemSize * slot + c]! * scale;
  }

  /** A vertex that was there has another position or normal. */
  move(name: "position" | "normal", slot: number, values: Float32Array, place: number, scale: number): void {
    const column = this.#columns.find((column) => column.name === name);
    if (!column?.attribute || slot >= this.#filled || (name === "normal" && column.file && !this.#bare.has(slot))) return;
    const factor = name === "normal" ? unitOf(column.attribute) : scale;
    for (let c = 0; c < 3; c++) column.attribute.array[3 * slot + c] = values[3 * place + c]! * factor;
    const moved = this.#moved.get(column);
    if (moved) moved.push(slot);
    else this.#moved.set(column, [slot]);
  }

  /** Values of the wedges added. `share`: how many times as many there may be. */
  fill(fresh: Fresh, share: number, places: Places): void {
    const [first, end] = [this.#filled, this.count];
    const most = Math.ceil(end * share);
    for (const column of this.#columns) {
      const { components, file } = column;
      const type = ARRAYS[file?.type ?? "f32"];
      const limits = { numbers: components * most, least: components * LEAST_ROOM };
      const [attribute, isFresh] = roomy(column.attribute, type, components, components * end, limits, file?.normalised ?? false);
      if (isFresh) this.#fresh.add(column);
      column.attribute = attribute;
    }
    const old = this.#old(fresh, places, first, end);
    for (const column of this.#columns) {
      if (column.source === "") this.#fillOwn(column, fresh, places, old);
      else this.#fillTold(column, fresh, places, old);
    }
  }

  /** Of the wedges added their vertices; and of vertices that were there the buffers and the place in them of a wedge that was there. */
  #old(fresh: Fresh, places: Places, first: number, end: number): Old {
    const isThere = (buffers: Buffers, slot: number) => slot < buffers.#filled;
    const old: Old = { first, vertices: new Uint32Array(end - first), slots: new Int32Array(end - first).fill(-1), homes: [] };
    for (let k = 0; k < end - first; k++) {
      const v = (old.vertices[k] = places.vertex(this.#wedges[first + k]!));
      const sibling = v < fresh.firstVertex ? places.sibling(v, isThere) : null;
      if (sibling) [old.homes[k], old.slots[k]] = sibling;
    }
    return old;
  }

  /** What all vertices have: of a new one it is told, of an old one a wedge has it that was there. */
  #fillOwn({ name, components, attribute }: Column, fresh: Fresh, places: Places, { first, vertices, slots, homes }: Old, only?: readonly number[]): void {
    const { array } = attribute!;
    const values = name === "born" ? fresh.born : fresh[name as "position" | "normal" | "from"];
    const scaled = name === "position" || name === "from";
    const unit = unitOf(attribute!);
    const one = (k: number) => {
      const v = vertices[k]!;
      const to = components * (first + k);
      if (v >= fresh.firstVertex) {
        const scale = scaled ? places.scale(v) : unit;
        const from = components * (v - fresh.firstVertex);
        for (let c = 0; c < components; c++) array[to + c] = values ? values[from + c]! * scale : fresh.time;
      } else if (slots[k]! >= 0) {
        const there = homes[k]!.#columns.find((other) => other.name === name)?.attribute?.array;
        for (let c = 0; there && c < components; c++) array[to + c] = there[components * slots[k]! + c]!;
      }
    };
    if (only) only.forEach(one);
    else for (let k = 0; k < vertices.length; k++) one(k);
  }

  /** What the file has. */
  #fillTold(column: Column, fresh: Fresh, places: Places, old: Old): void {
    const { name, components, file, attribute } = column;
    const array = attribute!.array as Numbers;
    const isNormal = name === "normal";
    const stand = standIn(column);
    const told = file ? (fresh.values[file.name] ?? null) : null;
    const bare: number[] = [];
    for (let k = 0; k < old.vertices.length; k++) {
      const w = this.#wedges[old.first + k]!;
      const to = components * (old.first + k);
      if (!file) {
        if (isNormal) bare.push(k);
        else for (let c = 0; c < components; c++) array[to + c] = stand[c] ?? 0;
      } else if (told && w >= fresh.firstWedge) {
        const from = file.components * (w - fresh.firstWedge);
        if (isNormal && !told[from] && !told[from + 1] && !told[from + 2]) bare.push(k);
        else for (let c = 0; c < components; c++) array[to + c] = c < file.components ? told[from + c]! : (stand[c] ?? 0);
        if (name === "skinWeight") sumToOne(array, to, components);
      } else {
        // Other buffers have had it first.
        const [home, at] = places.home(w);
        const there = home.#columns.find((other) => other.name === name)?.attribute?.array;
        for (let c = 0; c < components; c++) array[to + c] = there?.[components * at + c] ?? stand[c] ?? 0;
      }
    }
    if (bare.length === 0) return;
    for (const k of bare) this.#bare.add(old.first + k);
    this.#fillOwn(column, fresh, places, old, bare);
  }

  /** After a delta: what is to be sent. */
  end(): void {
    let [isNew, morphs] = [this.#isOther, false];
    this.#isOther = false;
    for (const column of this.#columns) {
      const { attribute } = column;
      if (!attribute) continue;
      const begins = this.#filled === 0 || this.#fresh.has(column);
      const moved = this.#moved.get(column);
      if (begins) {
        attribute.clearUpdateRanges();
        attribute.needsUpdate = true;
      } else if (this.count > this.#filled || moved) upload(attribute, column.components, this.#filled, this.count, moved);
      isNew ||= this.#fresh.has(column);
      morphs ||= column.target !== null && (begins || this.count > this.#filled);
    }
    this.#filled = this.count;
    this.#fresh.clear();
    this.#moved.clear();
    if (isNew) for (const geometry of this.geometries) this.#give(geometry);
    if (morphs) for (const geometry of this.geometries) geometry.renewTargets();
  }

  #give(geometry: PartGeometry): void {
    for (const { name, attribute, target, file, stand } of this.#columns) {
      if (!attribute) continue;
      if (!target) {
        // Without values it would be 0, which is worse than what a renderer makes up.
        if (file || stand || OF_ALL.includes(name)) geometry.setAttribute(name, attribute);
        else geometry.deleteAttribute(name);
        continue;
      }
      const morphs = (geometry.morphAttributes as Record<string, BufferAttribute[]>)[target[1]] ?? [];
      morphs[target[0]] = attribute;
      (geometry.morphAttributes as Record<string, BufferAttribute[]>)[target[1]] = morphs;
      geometry.morphTargetsRelative = true;
    }
  }

  /** The largest displacement of a morph target at a vertex, along each axis, added to `into`. */
  displacement(slot: number, into: Vector3): void {
    if (this.#targets === 0) return;
    for (const { target, attribute } of this.#columns) {
      if (target?.[1] !== "position" || !attribute) continue;
      const [x, y, z] = [0, 1, 2].map((c) => Math.abs(attribute.array[3 * slot + c]!)) as [number, number, number];
      into.set(Math.max(into.x, x), Math.max(into.y, y), Math.max(into.z, z));
    }
  }

  position(slot: number, into: Vector3): Vector3 {
    return into.fromArray(this.#columns[0]!.attribute!.array, 3 * slot);
  }
}

/**
 * The geometry of a part: an index of its own into buffers that it may share with others. Bounding box and sphere are of what has arrived, and of what may
 * still come.
 */
export class PartGeometry extends BufferGeometry<Record<string, BufferAttribute>, { dispose: object }> {
  readonly #box = new Box3();
  readonly #displacement = new Vector3();
  #error = 0;
  #isFresh = false;
  #isPlain = false;
  /** Triangles when it was measured last. */
  #measured = 0;

  /** Shows another geometry until there is something of its own. */
  begin(plain: BufferGeometry): this {
    if (this.index) return this;
    for (const [name, attribute] of Object.entries(plain.attributes)) this.setAttribute(name, attribute as BufferAttribute);
    this.morphAttributes = plain.morphAttributes;
    this.morphTargetsRelative = plain.morphTargetsRelative;
    this.setIndex(plain.index);
    this.#isPlain = true;
    if (plain.boundingBox) this.#box.copy(plain.boundingBox);
    this.boundingBox = null;
    this.computeBoundingSphere();
    return this;
  }

  /** Its triangles, not all vertices of the buffers. */
  override computeBoundingBox(): void {
    const box = this.#box.clone().expandByVector(this.#displacement);
    this.boundingBox = box.isEmpty() ? box : box.expandByScalar(this.#error);
  }

  override computeBoundingSphere(): void {
    if (!this.boundingBox) this.computeBoundingBox();
    this.boundingSphere = this.boundingBox!.getBoundingSphere(new Sphere());
  }

  /** The index, with room for so many triangles. */
  room(triangles: number, share: number): { [at: number]: number } {
    if (this.#isPlain) this.#bare();
    const limits = { numbers: Math.ceil(3 * triangles * share), least: 3 * LEAST_ROOM };
    if (this.index && this.index.array.length >= 3 * triangles) return this.index.array;
    const [index, isFresh] = roomy(this.index, Uint32Array, 1, 3 * triangles, limits);
    if (isFresh) this.setIndex(index);
    this.#isFresh ||= isFresh;
    return index.array;
  }

  reach(buffers: Buffers, slot: number): void {
    this.#box.expandByPoint(buffers.position(slot, point));
    buffers.displacement(slot, this.#displacement);
  }

  /** Lets go of the geometry that stood in for its own. */
  #bare(): void {
    const kept = this.attributes;
    this.#isPlain = false;
    this.morphAttributes = {};
    this.setIndex(null);
    for (const name of Object.keys(kept)) this.deleteAttribute(name);
  }

  /**
   * After a delta. Coarser levels are forgotten, whose vertices may have lain further out, where all is there and, lest every triangle be looked at with
   * every level, where there are twice as many as then.
   */
  end(part: PartOf, error: number, { anew, level, last }: { anew: boolean; level: boolean; last: boolean }): void {
    const scale = 2 ** -part.spec.exponent;
    if (anew || last || (level && part.count >= 2 * this.#measured)) this.#measure(part);
    if (!this.index) this.setIndex(new BufferAttribute(new Uint32Array(0), 1));
    const index = counted(this.index!, 3 * part.count);
    this.setDrawRange(0, 3 * part.count);
    if (anew || this.#isFresh) {
      index.clearUpdateRanges();
      index.needsUpdate = true;
    } else if (part.changed.length > 0) upload(index, 3, part.count, part.count, part.changed.filter((place) => place < part.count));
    this.#isFresh = false;
    part.changed = [];
    if (!level && this.boundingBox && this.#error === scale * error && this.boundingBox.containsBox(this.#box)) return;
    this.#error = scale * error;
    this.boundingBox = null;
    this.computeBoundingSphere();
  }

  #measure({ buffers, count }: PartOf): void {
    this.#measured = count;
    this.#box.makeEmpty();
    this.#displacement.set(0, 0, 0);
    const slots = this.index?.array;
    for (let k = 0; slots && k < 3 * count; k++) this.reach(buffers, slots[k]!);
  }

  /** The renderer has put morph targets into a texture, which it makes anew only for a geometry that is new to it. */
  renewTargets(): void {
    const { attributes, index } = this;
    this.attributes = {};
    this.index = null;
    this.dispatchEvent({ type: "dispose" });
    this.attributes = attributes;
    this.index = index;
  }
}

function column(name: string, components: number, source: string, target: Column["target"] = null): Column {
  return { name, components, source, stand: STAND_INS[name] ?? null, target, file: null, attribute: null };
}

/** Whether an attribute of the file is what glTF calls so. */
function isMeant({ semantic, set, name, domain }: FileAttribute, source: string): boolean {
  if (domain !== "corner") return false;
  const [, word, number] = /^(NORMAL|TANGENT|TEXCOORD|COLOR|JOINTS|WEIGHTS)(?:_(\d+))?$/.exec(source) ?? [];
  if (!word) return semantic === "generic" && name.replace(/_+$/, "") === source.replace(/_+$/, "");
  return semantic === SEMANTICS[word] && set === Number(number ?? 0);
}

/** What three.js calls an attribute of glTF. */
function nameOf(source: string): string {
  return NAMES[source] ?? source.toLowerCase();
}

/** glTF wants weights that add up to 1. */
function sumToOne(array: Numbers, at: number, components: number): void {
  if (array instanceof Float32Array === false) return;
  let sum = 0;
  for (let c = 0; c < components; c++) sum += array[at + c]!;
  for (let c = 0; c < components; c++) array[at + c] = sum > 0 ? array[at + c]! / sum : c === 0 ? 1 : 0;
}

/** What stands in the place of values, as the numbers of the attribute. */
function standIn({ stand, attribute }: Column): readonly number[] {
  return stand?.map((x) => x * unitOf(attribute!)) ?? [];
}

/** The number that stands for 1. */
function unitOf({ array, normalized }: BufferAttribute): number {
  return (normalized && LARGEST[array.constructor.name]) || 1;
}

const LARGEST: Readonly<Record<string, number>> = { Uint8Array: 255, Int8Array: 127, Uint16Array: 65535, Int16Array: 32767 };
const NAMES: Readonly<Record<string, string>> = {
  POSITION: "position",
  NORMAL: "normal",
  TANGENT: "tangent",
  TEXCOORD_0: "uv",
  TEXCOORD_1: "uv1",
  TEXCOORD_2: "uv2",
  TEXCOORD_3: "uv3",
  COLOR_0: "color",
  WEIGHTS_0: "skinWeight",
  JOINTS_0: "skinIndex",
};
const SEMANTICS: Readonly<Record<string, FileAttribute["semantic"]>> = {
  NORMAL: "normal",
  TANGENT: "tangent",
  TEXCOORD: "uv",
  COLOR: "color",
  JOINTS: "joints",
  WEIGHTS: "weights",
};
/** While there is no colour it is white; while there are no weights the first joint has all. */
const STAND_INS: Readonly<Record<string, readonly number[]>> = {
  color: [1, 1, 1, 1],
  skinIndex: [0, 0, 0, 0],
  skinWeight: [1, 0, 0, 0],
};
const OF_ALL = ["position", "normal", "from", "born"];
/** Least items that there is room for. */
const LEAST_ROOM = 1 << 10;
const point = new Vector3();
