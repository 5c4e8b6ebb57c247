/** For three.js: a loader whose geometries grow in place while their files arrive, geomorphs, and a planner for several meshes. */

import { Loader, type LoadingManager, type Material } from "three";
import { UnweldGeometry } from "./geometry.js";
import { decode, WorkerPool, type Until } from "./unweld.js";

export { UnweldEdges, UnweldGeometry, type GeometryOptions, type RefineEvent } from "./geometry.js";
export { levelFor, pixelError, pixelsPerUnit, UnweldPlanner } from "./scene.js";

/**
 * Loads `.uwm` files. `onLoad` gets the geometry as soon as it shows something, after the first kilobytes, and then the manager is told that
 * it is there; it is refined in place until the file is complete, and dispatches `refine` each time, `complete` or `error` at the end.
 * `geometry.complete` is a promise of that.
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
  /** Whether `geometry.want` will be used. */
  keep = false;
  /** Whether `geometry.show` will be used; `want` may be, too. */
  levels = false;
  /** Whether new vertices slide to their places: for materials that `geomorph` has changed. */
  morph = false;
  /** Bytes that `open` asks for first: mostly header, table of contents and base. */
  head = 16_384;
  /** How often in a row a lost connection is tried again. */
  retries = 5;
  /** What makes requests, if not `fetch`. */
  fetch: typeof globalThis.fetch | undefined;
  /** Whether a file that ends early is a prefix, and no fault. */
  prefix = false;
  /** Called whenever a geometry has changed, so that a picture can be drawn that is drawn only when it is asked for. */
  onChange: (geometry: UnweldGeometry) => void = () => {};
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
    const path = this.#resolve(url);
    const geometry = this.#geometry(path, false);
    let loaded = false;
    this.manager.itemStart(path);
    geometry.addEventListener("refine", ({ delta }) => {
      const [total, done] = [delta.contents.wanted.end, delta.bytes];
      onProgress?.(new ProgressEvent("progress", { lengthComputable: true, loaded: done, total }));
      if (loaded || !delta.level) return;
      loaded = true;
      onLoad(geometry);
      this.manager.itemEnd(path);
    });
    geometry.complete.catch((error: unknown) => {
      if (loaded) return;
      (onError ?? console.error)(error);
      this.manager.itemError(path);
      this.manager.itemEnd(path);
    });
  }

  /**
   * A geometry that is empty, and has nothing fetched, until something is wanted of it: by `geometry.want`, or by an `UnweldPlanner` that its
   * mesh is added to. `until` does not matter to it.
   */
  open(url: string): UnweldGeometry {
    return this.#geometry(this.#resolve(url), true);
  }

  #resolve(url: string): string {
    return this.manager.resolveURL(new URL(url, new URL(this.path, document.baseURI)).href);
  }

  #geometry(path: string, waits: boolean): UnweldGeometry {
    const signals = [this.#controller.signal, ...(this.#signal ? [this.#signal] : [])];
    this.#pool ??= new WorkerPool(this.#limit, this.workerUrl);
    const stream = decode(path, {
      pool: this.#pool,
      signal: AbortSignal.any(signals),
      until: waits ? { level: Infinity } : this.until,
      keep: this.keep || waits,
      jumps: this.morph,
      relative: this.relative,
      levels: this.levels || waits,
      ...(waits ? { head: this.head } : {}),
      retries: this.retries,
      fetch: this.fetch,
      prefix: this.prefix,
      request: {
        headers: this.requestHeader,
        credentials: this.withCredentials ? "include" : "same-origin",
      },
      ...(this.wasmUrl ? { wasm: this.wasmUrl } : {}),
    });
    const geometry = new UnweldGeometry(stream, { morph: this.morph, waits });
    geometry.addEventListener("refine", () => this.onChange(geometry));
    return geometry;
  }

  /** Ends the workers, and what they still load. */
  dispose(): void {
    this.abort();
    this.#pool?.dispose();
    this.#pool = null;
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
