// A geometry that grows in place, and its edges.

import { BufferAttribute, BufferGeometry, Box3, Sphere, Vector3 } from "three";
import { ARRAYS } from "./attributes.js";
import { Following } from "./following.js";
import { Parts } from "./parts.js";
import { counted, roomy, scatter, upload } from "./room.js";
import type { Attributes, Contents, Delta, FileAttribute, Level, MeshStream, Until } from "./unweld.js";
import { isFlat, Wedges } from "./wedges.js";

/** What `UnweldGeometry` dispatches when it has changed. */
export interface RefineEvent {
  type: "refine";
  delta: Delta;
}

/** All that `UnweldGeometry` dispatches: `complete` when all that is wanted is there or a prefix has ended, `error` when it will not be. */
export interface GeometryEvents {
  refine: RefineEvent;
  complete: object;
  error: { error: unknown };
  dispose: object;
}

/** Settings of a geometry. */
export interface GeometryOptions {
  /** Whether there are attributes for `geomorph`. */
  morph?: boolean;
  /** Whether it waits for `want`. */
  waits?: boolean;
}

/**
 * A geometry that deltas are applied to. From the level on at which attributes of the file are born, mostly the first that is there, its buffers are by
 * wedge; they are made anew only then. The arrays of attributes and index have room for more than their `count` and `drawRange` tell.
 * Bounding box and sphere are those of the whole file from the first; computed anew, they are of what has arrived.
 */
export class UnweldGeometry extends BufferGeometry<Record<string, BufferAttribute>, GeometryEvents> {
  /** What the file holds, once known. */
  contents: Contents | null = null;
  /** Vertices and triangles of the mesh as it stands. */
  vertices = 0;
  triangles = 0;
  /** The finest level that has arrived, or `null` before the base has. */
  finest: number | null = null;
  /** Whether it has attributes of the file: then its buffers are by wedge, and its groups are the parts, once those are alive. */
  dressed = false;
  /** Whether these have one normal for each triangle: then it is to be drawn with `flatShading`, at coarser levels without normals, too. */
  flat = false;
  /** The delta applied last. */
  last: Delta | null = null;
  /** When vertices were appended last, on `clock`. */
  lastBorn = -Infinity;
  /**
   * The level to make room for, `null` for what is wanted. Where a coarser level is shown, what it leaves empty of the room is given up: without a
   * level here, only if that is more than half of it.
   */
  room: number | null = null;
  /**
   * When all that is wanted first is there, or the prefix of a file has ended (`last.prefix`). Rejected with an `AbortError` where the geometry is
   * disposed of before.
   */
  readonly complete: Promise<void>;
  readonly #following: Following;
  readonly #relative: boolean;
  readonly #morph: boolean;
  readonly #begin = performance.now();
  #releasing = false;
  /** The wedges, where buffers are by wedge, and the parts, where the index is by part. */
  #wedges: Wedges | null = null;
  #parts: Parts | null = null;
  #alive: ReadonlySet<string> = new Set();

  /** Follows a stream. */
  constructor(stream: MeshStream, { morph = false, waits = false }: GeometryOptions = {}) {
    super();
    this.#relative = stream?.relative ?? false;
    this.#morph = morph;
    const ended = (error?: { error: unknown }) => this.dispatchEvent(error ? { type: "error", ...error } : { type: "complete" });
    this.#following = new Following(stream, { apply: (delta) => this.apply(delta), ended }, { waits });
    this.complete = this.#following.complete;
    this.addEventListener("dispose", () => this.#releasing || this.#following.dispose());
  }

  /** How far the surface jumped at most with the delta applied last, new vertices being where they begin: see `Delta.jump`. */
  get jump(): number {
    return this.last?.jump ?? 0;
  }

  /** Bytes of attributes and index. */
  get bytes(): number {
    const arrays = new Set([...Object.values(this.attributes), ...(this.index ? [this.index] : [])].map(({ array }) => array));
    return [...arrays].reduce((sum, { byteLength }) => sum + byteLength, 0);
  }

  /** Bytes that a level takes, without what residue and attributes of the file add to level 0. */
  bytesOf({ vertices, triangles }: Level): number {
    const attributes = this.contents?.attributes ?? [];
    const components = attributes.reduce((sum, { components }) => sum + components, this.#morph ? 4 : 0);
    return 4 * (components * vertices + 3 * triangles);
  }

  /** Seconds since loading began: what `geomorph` wants to know. */
  clock(): number {
    return (performance.now() - this.#begin) / 1000;
  }

  /** Shows a level that has arrived, or with `null` the finest; wants `UnweldLoader.levels`. */
  show(level: number | null): Promise<void> {
    return this.#following.show(level);
  }

  /**
   * Wants more or less of the file from now on; resolves when it is there. Only bytes that are missing are fetched; what there is stays. Where
   * a coarser level is shown, that comes first: `show(null)`.
   */
  want(until: Until): Promise<void> {
    return this.#following.want(until);
  }

  /** Goes on after a `ConnectionError`; resolves when all that is wanted is there. */
  resume(): Promise<void> {
    return this.#following.resume();
  }

  /** Applies what has changed; only that is sent to the graphics card. */
  apply(delta: Delta): void {
    const { contents, vertices, triangles } = delta;
    const start = performance.now();
    this.last = delta;
    for (const { level } of delta.levels) {
      this.finest = level;
      // A file begins, or another one in its place, or another mesh.
      if (contents.set || level === contents.levels.length - 1) this.flat = false;
    }
    if (contents !== this.contents || delta.levels.some(({ level }) => level === 0)) this.#bound(contents);
    if (delta.firstVertex === 0) {
      this.#undress();
      this.#shrink(vertices, triangles);
    }
    this.vertices = vertices;
    this.triangles = triangles;
    this.#grow(delta);
    // For the developer tools.
    performance.measure("unweld", { start });
    this.dispatchEvent({ type: "refine", delta });
  }

  /** Appends what is new, and changes what has changed. */
  #grow(delta: Delta): void {
    const { attributes, contents, firstVertex } = delta;
    const alive = attributes ? contents.fileAttributes.filter(({ name }) => attributes.alive.includes(name)) : [];
    const anew = attributes?.firstTriangle === 0;
    if (anew && firstVertex > 0) this.#strip(firstVertex);
    if (this.#wedges) this.#growWedges(delta, this.#wedges, alive);
    else this.#growVertices(delta);
    if (attributes && anew) this.#dress(attributes, alive);
    this.#connect(delta, alive);
    if (!attributes) return;
    const normal = alive.find(isNormal);
    if (normal) this.flat = isFlat(this.getAttribute(normal.name).array, this.index!.array, delta.triangles);
  }

  #growVertices(delta: Delta): void {
    const { contents, vertices } = delta;
    for (const { name, components } of contents.attributes) {
      const values = delta.appended[name];
      if (!values) continue;
      const [attribute, fresh] = this.#room(name, components, vertices, this.#most().vertices);
      const array = attribute.array;
      array.set(values, delta.firstVertex * components);
      const changed = delta.changed[name];
      if (changed) scatter(array, components, changed.vertices, changed.values);
      if (!fresh) upload(attribute, components, delta.firstVertex, vertices, changed?.vertices);
    }
    if (this.#morph) this.#bear(delta);
  }

  /** Changes what vertices have at all their wedges, and appends wedges. */
  #growWedges(delta: Delta, wedges: Wedges, alive: readonly FileAttribute[]): void {
    const { attributes, firstVertex } = delta;
    const [first, added] = [wedges.count, attributes?.vertices ?? NONE];
    const own = delta.contents.fileAttributes.find(({ name }) => name === "normal" && this.#alive.has(name));
    const moved = wedges.of(delta.changed.position?.vertices ?? NONE);
    const turned = own && wedges.bare.size === 0 ? NOBODY : wedges.of(delta.changed.normal?.vertices ?? NONE, own && wedges.bare);
    // What a new wedge of an old vertex has in common with the others of that.
    const siblings = Int32Array.from(added, (v) => (v < firstVertex ? wedges.any(v) : -1));
    wedges.append(added);
    const most = this.#mostWedges(wedges);
    const add = (name: string, components: number, values: (v: number, c: number) => number, changed = NOBODY, told?: ArrayLike<number>) => {
      const [attribute, fresh] = this.#room(name, components, wedges.count, most);
      const { array } = attribute;
      changed.wedges.forEach((w, k) => {
        for (let c = 0; c < components; c++) array[components * w + c] = told![components * changed.places[k]! + c]!;
      });
      for (let k = 0; k < added.length; k++) {
        const [to, from, v] = [components * (first + k), components * siblings[k]!, added[k]! - firstVertex];
        for (let c = 0; c < components; c++) array[to + c] = from >= 0 ? array[from + c]! : v >= 0 ? values(v, c) : 0;
      }
      if (!fresh) upload(attribute, components, first, wedges.count, changed.wedges);
    };
    const three = (values: ArrayLike<number>) => (v: number, c: number) => values[3 * v + c]!;
    add("position", 3, three(delta.appended.position!), moved, delta.changed.position?.values);
    if (!own || isNormal(own)) add("normal", 3, three(delta.appended.normal!), turned, delta.changed.normal?.values);
    if (this.#morph) {
      // New wedges slide with their vertices; texture coordinates and normals are theirs at once.
      const time = this.clock();
      if (delta.vertices > firstVertex) this.lastBorn = time;
      add("from", 3, three(delta.from));
      add("born", 1, () => time);
    }
    if (attributes) this.#values(attributes, alive, wedges, most);
  }

  /** The values of the wedges told. */
  #values({ firstWedge, values }: Attributes, alive: readonly FileAttribute[], wedges: Wedges, most: number): void {
    for (const file of alive) {
      if (file.domain !== "corner") continue;
      const { name, components } = file;
      const [told, isOf] = [values[name]!, isNormal(file)];
      const [attribute, fresh] = this.#room(name, components, wedges.count, most, file);
      for (let k = 0; k < told.length; k += components) {
        // Where the file has no normal, it is the one of the vertex, which is there already.
        if (isOf && !told[k] && !told[k + 1] && !told[k + 2]) wedges.bare.add(firstWedge + k / 3);
        else for (let c = 0; c < components; c++) attribute.array[components * firstWedge + k + c] = told[k + c]!;
      }
      if (!fresh) upload(attribute, components, firstWedge, wedges.count);
    }
  }

  /** Triangles, of vertices or of wedges. */
  #connect(delta: Delta, alive: readonly FileAttribute[]): void {
    const { attributes, triangles } = delta;
    const [anew, byWedge] = [attributes?.firstTriangle === 0, this.#wedges !== null];
    const [first, places] = byWedge && anew ? [0, NONE] : [delta.firstTriangle, delta.rewritten.triangles];
    const indices = byWedge ? (attributes?.indices ?? NONE) : delta.indices;
    const others = byWedge ? (attributes?.rewritten.indices ?? NONE) : delta.rewritten.indices;
    const part = alive.find(isPart);
    const before = this.#parts?.triangles ?? this.index?.array;
    if (attributes && anew) this.#parts = part ? new Parts() : null;
    const [index, fresh] = this.#room("index", 3, triangles, this.#most().triangles);
    this.setDrawRange(0, 3 * triangles);
    if (!this.#parts) {
      index.array.set(indices, 3 * first);
      scatter(index.array, 3, places, others);
      if (!fresh) upload(index, 3, first, triangles, places);
      return;
    }
    if (!attributes || !part) return;
    const [values, rewritten] = [attributes.values[part.name]!, attributes.rewritten.values[part.name]!];
    if (anew) {
      const all = new Uint32Array(3 * triangles);
      if (first > 0) all.set(before!.subarray(0, 3 * first));
      all.set(indices, 3 * first);
      scatter(all, 3, places, others);
      this.#parts.append(0, all, values);
    } else {
      this.#parts.append(first, indices, values);
      this.#parts.rewrite(places, others, rewritten);
    }
    this.clearGroups();
    for (const { part, start, count } of this.#parts.sort(triangles, index.array)) this.addGroup(start, count, part);
    if (!fresh) upload(index, 3, 0, triangles);
  }

  /** Attributes are born, or have come with all the rest: makes the buffers by wedge, from those by vertex. */
  #dress(attributes: Attributes, alive: readonly FileAttribute[]): void {
    this.#alive = new Set(attributes.alive);
    this.dressed = true;
    if (!alive.some(({ domain }) => domain === "corner")) return;
    const wedges = new Wedges();
    wedges.append(attributes.vertices);
    this.#exchange(wedges.count, this.#mostWedges(wedges), (w) => wedges.vertex(w));
    this.#wedges = wedges;
    this.#values(attributes, alive, wedges, this.#mostWedges(wedges));
  }

  /** Has buffers by vertex again, where they are by wedge: more attributes are about to be born. */
  #strip(vertices: number): void {
    const wedges = this.#wedges;
    if (!wedges) return;
    this.#exchange(vertices, this.#most().vertices, (v) => Math.max(wedges.any(v), 0));
    this.#wedges = null;
  }

  /** Buffers of what all meshes have, of so many items, each as the item in the old ones that `source` names. */
  #exchange(count: number, most: number, source: (item: number) => number): void {
    const old = OF_VERTICES.flatMap((name) => (this.attributes[name] ? [[name, this.attributes[name]] as const] : []));
    this.#empty();
    for (const [name, { array, itemSize }] of old) {
      const [attribute] = this.#room(name, itemSize, count, most);
      for (let k = 0; k < count; k++) {
        const from = itemSize * source(k);
        for (let c = 0; c < itemSize; c++) attribute.array[itemSize * k + c] = array[from + c]!;
      }
    }
  }

  /** Everything is new, and by vertex. */
  #undress(): void {
    if (!this.dressed) return;
    this.#empty();
    this.clearGroups();
    [this.dressed, this.#wedges, this.#parts, this.#alive] = [false, null, null, new Set()];
  }

  #most(): { readonly vertices: number; readonly triangles: number } {
    const contents = this.contents!;
    return (this.room === null ? null : contents.levels[this.room]) ?? contents.wanted;
  }

  /** How many wedges there may be: nobody says so; as many a vertex as there are now, or twice the room that has not sufficed. */
  #mostWedges({ count }: Wedges): number {
    const position = this.getAttribute("position") as BufferAttribute | undefined;
    const room = this.#wedges && position ? position.array.length / 3 : 0;
    return Math.max(Math.ceil((count / Math.max(this.vertices, 1)) * this.#most().vertices), room < count ? 2 * room : 0);
  }

  /** Gives up room that a coarser level leaves empty. */
  #shrink(vertices: number, triangles: number): void {
    const room = (this.getAttribute("position")?.array.length ?? 0) / 3;
    const most = this.#most();
    const [v, t] = [Math.max(vertices, most.vertices), Math.max(triangles, most.triangles)];
    const spare = this.room === null ? 2 : 1;
    if (room <= spare * v && (this.index?.array.length ?? 0) <= 3 * spare * t) return;
    this.#empty();
  }

  /** Gives up all buffers. */
  #empty(): void {
    // Only so does the renderer give back its own.
    this.#releasing = true;
    this.dispatchEvent({ type: "dispose" });
    this.#releasing = false;
    for (const name of Object.keys(this.attributes)) this.deleteAttribute(name);
    this.setIndex(null);
  }

  /** Notes where new vertices come from, and when. */
  #bear(delta: Delta): void {
    const { firstVertex, vertices } = delta;
    const most = this.#most().vertices;
    const [from, freshFrom] = this.#room("from", 3, vertices, most);
    const [born, freshBorn] = this.#room("born", 1, vertices, most);
    from.array.set(delta.from, 3 * firstVertex);
    const time = firstVertex > 0 ? this.clock() : -LONG_AGO;
    if (firstVertex > 0 && vertices > firstVertex) this.lastBorn = time;
    born.array.fill(time, firstVertex, vertices);
    if (!freshFrom) upload(from, 3, firstVertex, vertices);
    if (!freshBorn) upload(born, 1, firstVertex, vertices);
  }

  /** The bounding box is known from the first bytes on. Vertices of coarse levels can lie outside the input's, by no more than their level's error. */
  #bound(contents: Contents): void {
    this.contents = contents;
    const relative = this.#relative;
    const min = new Vector3(...(relative ? [0, 0, 0] : contents.min));
    const max = new Vector3(...contents.max);
    if (relative) max.sub(new Vector3(...contents.min));
    const box = new Box3(min, max);
    if (this.finest !== 0) box.expandByScalar(Math.max(...contents.levels.map((level) => level.maxError)));
    this.boundingBox = box;
    this.boundingSphere = box.getBoundingSphere(new Sphere());
  }

  /**
   * The attribute, with room for `count` items: at once for all that the file will have, if that is but a few times what there is now, for no
   * header's claim shall cost memory. Tells whether it is a new one, which is sent as a whole.
   */
  #room(name: string, components: number, count: number, most: number, file?: FileAttribute): [attribute: BufferAttribute, fresh: boolean] {
    const type = ARRAYS[name === "index" ? "u32" : (file?.type ?? "f32")];
    const there = name === "index" ? this.index : this.getAttribute(name);
    // A file's own normals may be of another type than those worked out.
    const limits = { numbers: components * most, least: components * LEAST_ROOM };
    const [attribute, fresh] = roomy(there as BufferAttribute | null, type, name === "index" ? 1 : components, components * count, limits, file?.normalised);
    if (!fresh) return [attribute, false];
    if (name === "index") this.setIndex(attribute);
    else this.setAttribute(name, attribute);
    return [attribute, true];
  }
}

/** The edges of a growing geometry, for `LineSegments`: it shares the positions and follows. */
export class UnweldEdges extends BufferGeometry {
  readonly #mesh: UnweldGeometry;
  readonly #refine = ({ delta }: RefineEvent) => this.#apply(delta);

  constructor(mesh: UnweldGeometry) {
    super();
    this.#mesh = mesh;
    this.#renew();
    mesh.addEventListener("refine", this.#refine);
  }

  override dispose(): void {
    this.#mesh.removeEventListener("refine", this.#refine);
    // The positions are the mesh's.
    this.deleteAttribute("position");
    super.dispose();
  }

  #renew(): void {
    const mesh = this.#mesh;
    const index = new BufferAttribute(new Uint32Array(2 * (mesh.index?.array.length ?? 0)), 1);
    this.setIndex(index);
    for (let t = 0; t < mesh.triangles; t++) this.#copy(t);
    this.#share();
  }

  #apply(delta: Delta): void {
    const { index } = this;
    const isSorted = this.#mesh.groups.length > 0;
    if (!index || delta.attributes?.firstTriangle === 0 || (isSorted && delta.attributes) || index.array.length < 6 * this.#mesh.triangles) return this.#renew();
    for (let t = delta.firstTriangle; t < delta.triangles; t++) this.#copy(t);
    for (const t of delta.rewritten.triangles) this.#copy(t);
    upload(index, 6, delta.firstTriangle, delta.triangles, delta.rewritten.triangles);
    this.#share();
  }

  #copy(t: number): void {
    const [from, to] = [this.#mesh.index!.array, this.index!.array];
    const [a, b, c] = [from[3 * t]!, from[3 * t + 1]!, from[3 * t + 2]!];
    to[6 * t] = to[6 * t + 5] = a;
    to[6 * t + 1] = to[6 * t + 2] = b;
    to[6 * t + 3] = to[6 * t + 4] = c;
  }

  #share(): void {
    const mesh = this.#mesh;
    for (const name of Object.keys(this.attributes)) if (!mesh.attributes[name]) this.deleteAttribute(name);
    for (const [name, attribute] of Object.entries(mesh.attributes)) {
      if (this.attributes[name] !== attribute && name !== "normal") this.setAttribute(name, attribute);
    }
    this.boundingBox = mesh.boundingBox;
    this.boundingSphere = mesh.boundingSphere;
    counted(this.index!, 6 * mesh.triangles);
    this.setDrawRange(0, 6 * mesh.triangles);
  }
}

/** The normals that a surface is shaded with. */
function isNormal({ name, domain, type, semantic, components }: FileAttribute): boolean {
  return name === "normal" && domain === "corner" && type === "f32" && semantic === "normal" && components === 3;
}

function isPart({ semantic, domain, components }: FileAttribute): boolean {
  return semantic === "part" && domain === "triangle" && components === 1;
}

const NONE = new Uint32Array(0);
const NOBODY: ReturnType<Wedges["of"]> = { wedges: NONE, places: NONE };
/** What every mesh has, by vertex or by wedge. */
const OF_VERTICES = ["position", "normal", "from", "born"];
/** Least items that there is room for. */
const LEAST_ROOM = 1 << 14;
/** Seconds: vertices born then are in their places. */
const LONG_AGO = 1e6;
