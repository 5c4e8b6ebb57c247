import { checkNames, checkUntil } from "./checks.js";
import { ConnectionError } from "./errors.js";
import { WorkerPool } from "./pool.js";
import type { Decoding } from "./session.js";
import { Source, type Input, type SourceOptions } from "./source.js";
import type { Contents, Delta, Settings, Until } from "./types.js";

export interface DecodeOptions extends Settings, SourceOptions {
  /** Where to decode: by default workers that all meshes share. */
  pool?: WorkerPool;
  /** Whether the stream stays open when all that is wanted is there, for `want`: until `close`. With `levels` it does anyway. */
  keep?: boolean;
}

/**
 * Decodes a mesh while its bytes arrive.
 *
 * ```js
 * for await (const delta of decode("bunny.uwm")) console.log(delta.triangles);
 * ```
 *
 * Errors: `FormatError`, `LimitError`, `HttpError`, `ConnectionError`, and the reason of the signal; at once a `TypeError` for an option that there is
 * not. Whatever it is, the deltas before it
 * make a valid mesh.
 */
export function decode(input: Input, options: DecodeOptions = {}): MeshStream {
  return new MeshStream(input, options);
}

/** A mesh on its way. It can be iterated once, and again after a `ConnectionError` or `want`: then it goes on where it was. */
export class MeshStream implements AsyncIterableIterator<Delta> {
  /** What the file holds, from the first delta on. */
  contents: Contents | null = null;
  /** @internal Milliseconds from one delta to the next, unless all is there: who takes long to apply them gets fewer, and larger ones. */
  pace = 0;
  readonly #options: DecodeOptions;
  readonly #source: Source;
  readonly #decoding: Decoding;
  #pump: Promise<void> | null = null;
  #error: unknown = null;
  /** How often something else was wanted, and what to call when it is. */
  #wants = 0;
  #wake: (() => void) | null = null;
  #state: "open" | "complete" | "closed" = "open";
  /** What `peek` has looked at. */
  #peeked: IteratorResult<Delta, undefined> | null = null;
  readonly #abort = () => this.close();

  constructor(input: Input, options: DecodeOptions) {
    checkNames("decode", options, OPTIONS);
    checkUntil(options.until ?? {});
    this.#options = options;
    const { until, relative, levels, jumps, resources, ownNormals, most, wasm } = options;
    const settings: Settings = {};
    if (until) settings.until = until;
    if (relative) settings.relative = relative;
    if (levels) settings.levels = levels;
    if (jumps) settings.jumps = jumps;
    if (resources) settings.resources = resources;
    if (ownNormals) settings.ownNormals = ownNormals;
    if (most) settings.most = most;
    if (wasm) settings.wasm = wasm;
    const pool = options.pool ?? shared();
    const isReady = pool.isReady(settings);
    this.#decoding = pool.open(settings);
    const head = options.head ?? (isReady || !isOwn(input) ? undefined : COLD_HEAD);
    this.#source = new Source(input, { ...options, head });
    options.signal?.addEventListener("abort", this.#abort, { once: true });
  }

  /** Bytes received so far. */
  get received(): number {
    return this.#source.received;
  }

  /** Whether there is more to iterate over. */
  get isOpen(): boolean {
    return this.#state === "open";
  }

  /** Whether positions are relative to `contents.min`. */
  get relative(): boolean {
    return this.#options.relative ?? false;
  }

  [Symbol.asyncIterator](): this {
    return this;
  }

  /** What the file holds, before anything of it is taken: the next delta stays the next; `null` where there is none. */
  async peek(): Promise<Contents | null> {
    this.#peeked ??= await this.next();
    return this.#peeked.value?.contents ?? null;
  }

  async next(): Promise<IteratorResult<Delta, undefined>> {
    if (this.#peeked) {
      const peeked = this.#peeked;
      this.#peeked = null;
      return peeked;
    }
    const { signal } = this.#options;
    signal?.throwIfAborted();
    if (this.#state !== "open") return { done: true, value: undefined };
    this.#pump ??= this.#run();
    try {
      const delta = await this.#decoding.next(this.pace);
      signal?.throwIfAborted();
      if (delta) {
        this.#know(delta.contents);
        return { done: false, value: delta };
      }
    } catch (error) {
      this.close();
      throw signal?.aborted ? signal.reason : error;
    }
    const error = this.#error;
    if (error) {
      await this.#pump;
      this.#error = this.#pump = null;
      if (!(error instanceof ConnectionError)) this.close();
      throw error;
    }
    if (this.#state === "open") this.#state = "complete";
    if (!this.#options.levels && !this.#options.keep) this.close();
    return { done: true, value: undefined };
  }

  /** Ends the stream: what `break` does. */
  async return(): Promise<IteratorResult<Delta, undefined>> {
    this.close();
    return { done: true, value: undefined };
  }

  /**
   * Wants more or less from now on. Where it is more than there is, iterate again, or go on doing so: only bytes that are missing are
   * fetched, by Range. Where it is less, what is there stays, and the stream ends early; `show` goes down.
   */
  async want(until: Until): Promise<void> {
    checkUntil(until);
    if (this.#state === "closed") throw new TypeError("the stream is closed");
    const contents = await this.#decoding.want(until);
    if (contents) {
      this.#know(contents);
      this.#source.expected = contents.wanted.end;
      if (this.#source.isSatisfied) this.#source.rest();
      for (const number of contents.lacking) {
        await this.#decoding.add(number, await this.#source.part(contents.resources[number]!.range));
      }
    }
    if (this.#state === "complete") this.#state = "open";
    this.#wants++;
    this.#wake?.();
  }

  #know(contents: Contents): void {
    this.contents = contents;
    this.#source.holes = contents.wanted.holes;
  }

  /**
   * The mesh at a level that has been decoded, or with `null` at the finest, as a delta in which everything is new. Until the finest is
   * shown again, decoding rests. Wants the option `levels`.
   */
  show(level: number | null): Promise<Delta> {
    if (!this.#options.levels) return Promise.reject(new TypeError("decode was not told to keep levels"));
    return this.#decoding.show(level);
  }

  /** Ends the stream and gives back its memory. */
  close(): void {
    if (this.#state === "closed") return;
    this.#state = "closed";
    this.#options.signal?.removeEventListener("abort", this.#abort);
    this.#source.cancel();
    this.#decoding.close();
    this.#wake?.();
  }

  /** Reads what is wanted, and waits until more is; an error waits until what came before it is decoded. */
  async #run(): Promise<void> {
    const source = this.#source;
    try {
      await this.#decoding.end("no");
      while (this.#state !== "closed") {
        const wants = this.#wants;
        if (source.isSatisfied) {
          source.rest();
          if (wants === this.#wants) await new Promise<void>((resolve) => (this.#wake = resolve));
          continue;
        }
        const bytes = await source.read();
        if (bytes === "restart") await this.#decoding.restart();
        else if (bytes) source.expected = (await this.#decoding.push(bytes, source.received - bytes.byteLength)) ?? source.expected;
        else if (source.isOver) await this.#decoding.end(source.isPrefix ? "prefix" : "for good");
      }
    } catch (error) {
      if (this.#state === "closed") return;
      this.#error = error;
      await this.#decoding.end("for now").catch(() => {});
    }
  }
}

/** Whether an input is fetched from where the page is: there a connection can be taken up again without more rights. */
function isOwn(input: Input): boolean {
  const { origin } = globalThis.location ?? {};
  if (!origin || (typeof input !== "string" && input instanceof URL === false)) return false;
  const url = new URL(input, globalThis.document?.baseURI ?? location.href);
  return url.origin === origin && url.protocol.startsWith("http");
}

/** Bytes asked for first while the module is on its way: a base mostly. The rest would only keep the module from coming. */
const COLD_HEAD = 32_768;
/** The names in `DecodeOptions`. */
const OPTIONS = Object.keys({
  until: true,
  relative: true,
  levels: true,
  jumps: true,
  resources: true,
  ownNormals: true,
  most: true,
  wasm: true,
  signal: true,
  retries: true,
  request: true,
  fetch: true,
  head: true,
  prefix: true,
  pool: true,
  keep: true,
} satisfies Record<keyof DecodeOptions, true>);
let pool: WorkerPool | null = null;

function shared(): WorkerPool {
  return (pool ??= new WorkerPool());
}
