/** A loader for three.js: a geometry that grows in place while its file arrives. */

import {
  BufferAttribute,
  BufferGeometry,
  Box3,
  Loader,
  type LoadingManager,
  type Material,
  Sphere,
  type TypedArray,
  Vector3,
} from "three";
import { decode, WorkerPool, type Contents, type Delta, type MeshStream, type Until } from "./unweld.js";

/** What `UnweldGeometry` dispatches. */
export interface RefineEvent {
  type: "refine";
  delta: Delta;
}

/**
 * Loads `.uwm` files. `onLoad` gets the geometry as soon as it shows something, after the first kilobytes; it is refined in place until the
 * file is complete, and dispatches `refine` each time. `geometry.complete` is a promise of that.
 *
 * ```js
 * const geometry = await new UnweldLoader().loadAsync("bunny.uwm");
 * scene.add(new Mesh(geometry, new MeshStandardMaterial()));
 * ```
 */
export class UnweldLoader extends Loader<UnweldGeometry> {
  /** How far to decode. */
  until: Until = {};
  /** Positions relative to the smallest corner of the bounding box, which is `geometry.contents.min`. */
  relative = false;
  /** Whether `geometry.show` will be used. */
  levels = false;
  /** Whether new vertices slide to their places: for materials that `geomorph` has changed. */
  morph = false;
  /** How often in a row a lost connection is tried again. */
  retries = 5;
  /** Where `worker.js` and `unweld.wasm` are, if not beside the script. */
  workerUrl: string | URL | undefined;
  wasmUrl: string | URL | undefined;
  #limit = 4;
  #pool: WorkerPool | null = null;
  #signal: AbortSignal | undefined;
  #controller = new AbortController();

  constructor(manager?: LoadingManager) {
    super(manager);
  }

  /** Most workers. */
  setWorkerLimit(limit: number): this {
    this.#limit = limit;
    if (this.#pool) this.#pool.limit = limit;
    return this;
  }

  /** What ends loading: before `onLoad` with an error, later in `geometry.complete`; the geometry stays as it is. */
  setSignal(signal: AbortSignal | undefined): this {
    this.#signal = signal;
    return this;
  }

  /** Ends all that is being loaded. */
  override abort(): this {
    this.#controller.abort();
    this.#controller = new AbortController();
    return this;
  }

  override load(
    url: string,
    onLoad: (geometry: UnweldGeometry) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void {
    const path = this.manager.resolveURL(new URL(url, new URL(this.path, document.baseURI)).href);
    const signals = [this.#controller.signal, ...(this.#signal ? [this.#signal] : [])];
    this.#pool ??= new WorkerPool(this.#limit, this.workerUrl);
    const stream = decode(path, {
      pool: this.#pool,
      signal: AbortSignal.any(signals),
      until: this.until,
      relative: this.relative,
      levels: this.levels,
      retries: this.retries,
      request: {
        headers: this.requestHeader,
        credentials: this.withCredentials ? "include" : "same-origin",
      },
      ...(this.wasmUrl ? { wasm: this.wasmUrl } : {}),
    });
    const geometry = new UnweldGeometry(stream, this.morph);
    let loaded = false;
    this.manager.itemStart(path);
    geometry.addEventListener("refine", ({ delta }) => {
      const [total, done] = [delta.contents.wanted.end, delta.bytes];
      onProgress?.(new ProgressEvent("progress", { lengthComputable: true, loaded: done, total }));
      if (!loaded && delta.level) {
        loaded = true;
        onLoad(geometry);
      }
    });
    const ended = geometry.complete.then(
      () => {},
      (error: unknown) => {
        if (!loaded) (onError ?? console.error)(error);
        this.manager.itemError(path);
      },
    );
    void ended.then(() => this.manager.itemEnd(path));
  }

  /** Ends the workers, and what they still load. */
  dispose(): void {
    this.abort();
    this.#pool?.dispose();
    this.#pool = null;
  }
}

/** A geometry that deltas are applied to. Attributes have room for more than `drawRange` shows. */
export class UnweldGeometry extends BufferGeometry<
  Record<string, BufferAttribute>,
  { refine: RefineEvent; dispose: object }
> {
  /** What the file holds, once known. */
  contents: Contents | null = null;
  /** Vertices and triangles of the mesh as it stands. */
  vertices = 0;
  triangles = 0;
  /** The finest level that has arrived, or `null` before the base has. */
  finest: number | null = null;
  /** The delta applied last. */
  last: Delta | null = null;
  /** When vertices were appended last, on `clock`. */
  lastBorn = -Infinity;
  /** When all that is wanted is there. */
  readonly complete: Promise<void>;
  readonly #stream: MeshStream;
  readonly #morph: boolean;
  readonly #begin = performance.now();

  /** Follows a stream; with `morph` there are attributes for `geomorph`. */
  constructor(stream: MeshStream, morph = false) {
    super();
    this.#stream = stream;
    this.#morph = morph;
    this.complete = this.#follow();
    this.complete.catch(() => {});
    this.addEventListener("dispose", () => stream.close());
  }

  /** Seconds since loading began: what `geomorph` wants to know. */
  clock(): number {
    return (performance.now() - this.#begin) / 1000;
  }

  /** Shows a level that has arrived, or with `null` the finest; wants `UnweldLoader.levels`. */
  async show(level: number | null): Promise<void> {
    this.apply(await this.#stream.show(level));
  }

  /** Goes on after a `ConnectionError`; returns what `complete` would be. */
  resume(): Promise<void> {
    return this.#follow();
  }

  /** Applies what has changed; only that is sent to the graphics card. */
  apply(delta: Delta): void {
    const { contents, vertices, triangles } = delta;
    const start = performance.now();
    this.last = delta;
    for (const { level } of delta.levels) this.finest = level;
    if (contents !== this.contents) this.#bound(contents);
    this.vertices = vertices;
    this.triangles = triangles;
    for (const { name, components } of contents.attributes) {
      const values = delta.appended[name];
      if (!values) continue;
      const [attribute, fresh] = this.#room(name, components, vertices, contents.vertices);
      const array = attribute.array;
      array.set(values, delta.firstVertex * components);
      const changed = delta.changed[name];
      if (changed) scatter(array, components, changed.vertices, changed.values);
      if (!fresh) upload(attribute, components, delta.firstVertex, vertices, changed?.vertices);
    }
    if (this.#morph) this.#bear(delta);
    const [index, fresh] = this.#room("index", 3, triangles, contents.triangles);
    index.array.set(delta.indices, 3 * delta.firstTriangle);
    scatter(index.array, 3, delta.rewritten.triangles, delta.rewritten.indices);
    if (!fresh) upload(index, 3, delta.firstTriangle, triangles, delta.rewritten.triangles);
    this.setDrawRange(0, 3 * triangles);
    // For the developer tools.
    performance.measure("unweld", { start });
    this.dispatchEvent({ type: "refine", delta });
  }

  async #follow(): Promise<void> {
    for await (const delta of this.#stream) this.apply(delta);
  }

  /** Notes where new vertices come from, and when. */
  #bear(delta: Delta): void {
    const { firstVertex, vertices, contents } = delta;
    const [from, freshFrom] = this.#room("from", 3, vertices, contents.vertices);
    const [born, freshBorn] = this.#room("born", 1, vertices, contents.vertices);
    from.array.set(delta.from, 3 * firstVertex);
    const time = firstVertex > 0 ? this.clock() : -LONG_AGO;
    if (firstVertex > 0 && vertices > firstVertex) this.lastBorn = time;
    born.array.fill(time, firstVertex, vertices);
    if (!freshFrom) upload(from, 3, firstVertex, vertices);
    if (!freshBorn) upload(born, 1, firstVertex, vertices);
  }

  /** The bounding box is known from the first bytes on. */
  #bound(contents: Contents): void {
    this.contents = contents;
    const relative = this.#stream.relative;
    const min = new Vector3(...(relative ? [0, 0, 0] : contents.min));
    const max = new Vector3(...contents.max);
    if (relative) max.sub(new Vector3(...contents.min));
    this.boundingBox = new Box3(min, max);
    this.boundingSphere = this.boundingBox.getBoundingSphere(new Sphere());
  }

  /**
   * The attribute, with room for `count` items: at once for all that the file will have, if that is but a few times what there is now, for no
   * header's claim shall cost memory. Tells whether it is a new one, which is sent as a whole.
   */
  #room(name: string, components: number, count: number, most: number): [attribute: BufferAttribute, fresh: boolean] {
    const old = name === "index" ? this.index : this.getAttribute(name);
    if (old && old.count * old.itemSize >= count * components) return [old as BufferAttribute, false];
    const room = components * Math.max(count, Math.min(most, Math.max(LEAST_ROOM, GROWTH * count)));
    const array = name === "index" ? new Uint32Array(room) : new Float32Array(room);
    if (old) array.set(old.array);
    const attribute = new BufferAttribute(array, name === "index" ? 1 : components);
    if (name === "index") this.setIndex(attribute);
    else this.setAttribute(name, attribute);
    return [attribute, true];
  }
}

/**
 * Lets new vertices slide from the edge that they split to their own places (Hoppe, Progressive Meshes, 1996), for a geometry loaded with
 * `morph`. Set `time.value` to `geometry.clock()` before each picture; `seconds.value` is how long it takes, 0 for not at all.
 */
export function geomorph(material: Material): { time: { value: number }; seconds: { value: number } } {
  const slide = { time: { value: 0 }, seconds: { value: 0 } };
  material.onBeforeCompile = (shader) => {
    shader.uniforms.unweldTime = slide.time;
    shader.uniforms.unweldSeconds = slide.seconds;
    shader.vertexShader = shader.vertexShader
      .replace(
        "#include <common>",
        "#include <common>\nuniform float unweldTime, unweldSeconds;\nattribute vec3 from;\nattribute float born;",
      )
      .replace(
        "#include <begin_vertex>",
        "float way = unweldSeconds > 0.0 ? smoothstep(0.0, 1.0, (unweldTime - born) / unweldSeconds) : 1.0;\n" +
          "vec3 transformed = mix(from, position, way);",
      );
  };
  return slide;
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
    const index = new BufferAttribute(new Uint32Array(2 * (mesh.index?.count ?? 0)), 1);
    this.setIndex(index);
    for (let t = 0; t < mesh.triangles; t++) this.#copy(t);
    this.#share();
  }

  #apply(delta: Delta): void {
    const { index } = this;
    if (!index || index.count < 6 * this.#mesh.triangles) return this.#renew();
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
    for (const [name, attribute] of Object.entries(mesh.attributes)) {
      if (this.attributes[name] !== attribute && name !== "normal") this.setAttribute(name, attribute);
    }
    this.boundingBox = mesh.boundingBox;
    this.boundingSphere = mesh.boundingSphere;
    this.setDrawRange(0, 6 * mesh.triangles);
  }
}

/** Least items that there is room for. */
const LEAST_ROOM = 1 << 14;
/** Seconds: vertices born then are in their places. */
const LONG_AGO = 1e6;
/** How many times the room grows. */
const GROWTH = 4;
/** Items that are sent together if one of them has changed: a call costs as much as some kilobytes. */
const BLOCK = 512;

/** Blocks between two that are sent with them. */
const NEAR = 4;

function scatter(array: TypedArray, components: number, places: Uint32Array, values: ArrayLike<number>): void {
  for (let k = 0; k < places.length; k++) {
    const to = components * places[k]!;
    for (let c = 0; c < components; c++) array[to + c] = values[components * k + c]!;
  }
}

/** Marks what has to be sent: items from `first` to `end`, and the blocks that `places` lie in. */
function upload(attribute: BufferAttribute, size: number, first: number, end: number, places?: Uint32Array): void {
  const add = (from: number, to: number) => attribute.addUpdateRange(from * size, (to - from) * size);
  if (places?.length) {
    const blocks = new Uint8Array(Math.ceil(first / BLOCK));
    for (const place of places) blocks[Math.floor(place / BLOCK)] = 1;
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
