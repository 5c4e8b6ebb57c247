// What loaders of three.js have in common: settings, workers, signals.

import { Loader, type LoadingManager } from "three";
import { decode, WorkerPool, type MeshStream, type Until } from "./unweld.js";

/** Loads files that go on refining once they are there. */
export abstract class StreamLoader<T> extends Loader<T> {
  /** How far to decode. */
  until: Until = {};
  /** Whether `want` will be used. */
  keep = false;
  /** Whether `show` will be used; `want` may be, too. */
  levels = false;
  /** Whether new vertices slide to their places. */
  morph = false;
  /** Bytes that are asked for first where only a part will be wanted: mostly header, table of contents and base. */
  head = 16_384;
  /** How often in a row a lost connection is tried again. */
  retries = 5;
  /** What makes requests, if not `fetch`. */
  fetch: typeof globalThis.fetch | undefined;
  /** Whether a file that ends early is a prefix, and no fault. */
  prefix = false;
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

  /** What ends loading: before `onLoad` with an error, later in `complete`; what is shown stays as it is. */
  setSignal(signal: AbortSignal | undefined): this {
    this.#signal = signal;
    return this;
  }

  /** Starts a worker and has the module fetched and compiled before there is anything to load: for pages that will load something later. */
  async preload(): Promise<void> {
    await this.#workers().preload(this.wasmUrl);
  }

  /** Ends all that is being loaded. */
  override abort(): this {
    this.#controller.abort();
    this.#controller = new AbortController();
    return this;
  }

  /** Ends the workers, and what they still load. */
  dispose(): void {
    this.abort();
    this.#pool?.dispose();
    this.#pool = null;
  }

  /** The address in full. */
  protected resolve(url: string): string {
    return this.manager.resolveURL(new URL(url, new URL(this.path, document.baseURI)).href);
  }

  /** A stream of a file; one that `waits` has nothing fetched until something is wanted. */
  protected stream(path: string, { waits = false, relative = false, resources = false }): MeshStream {
    const signals = [this.#controller.signal, ...(this.#signal ? [this.#signal] : [])];
    return decode(path, {
      pool: this.#workers(),
      signal: AbortSignal.any(signals),
      until: waits ? { level: Infinity } : this.until,
      keep: this.keep || waits,
      jumps: this.morph,
      relative,
      resources,
      ...(resources ? { ownNormals: true, most: SCENE_MOST } : {}),
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
  }

  #workers(): WorkerPool {
    return (this.#pool ??= new WorkerPool(this.#limit, this.workerUrl));
  }
}

/** Numbers that are applied to a scene at a time: its buffers take longer than those of one mesh. */
export const SCENE_MOST = 200_000;
