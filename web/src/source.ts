// Bytes in order, over connections that break.

import { ConnectionError, HttpError } from "./errors.js";

/** What a mesh can be decoded from. With an address, a broken connection is taken up again where it broke. */
export type Input =
  | string
  | URL
  | Request
  | Response
  | Promise<Response>
  | Blob
  | ArrayBuffer
  | Uint8Array
  | ReadableStream<Uint8Array>
  | AsyncIterable<Uint8Array>;

export interface SourceOptions {
  signal?: AbortSignal | undefined;
  /** How often in a row a connection is tried again, after 0.5, 1, 2, 4 … seconds; 5 by default. */
  retries?: number | undefined;
  /** For requests that this package makes. */
  request?: RequestInit | undefined;
  /** What makes those requests, `fetch` by default. */
  fetch?: typeof globalThis.fetch | undefined;
  /** Bytes to ask for first, when only a part will be wanted; by default the answer is cut off where it is no longer wanted. */
  head?: number | undefined;
  /** Whether an input that ends early is a prefix of a file, and no fault; one that a server calls so (`Unweld-Bytes`) always is. */
  prefix?: boolean | undefined;
}

interface Reader {
  read(): Promise<{ done?: boolean | undefined; value?: Uint8Array | undefined }>;
  cancel(): Promise<unknown>;
}

/** Reads an input from its first byte. */
export class Source {
  /** Bytes returned by `read` since the last `"restart"`. */
  received = 0;
  /** Bytes that are wanted, once known: less is a connection lost, and no more are asked for. */
  expected: number | null = null;
  /** Where no bytes are wanted: they are jumped over where that saves something. */
  holes: readonly (readonly [number, number])[] = [];
  /** Whether the input has ended. */
  isOver = false;
  /** Whether it has ended as a prefix of the file: what is wanted is not all there, and no fault. */
  isPrefix = false;
  /** Where to ask again; empty where that is impossible. */
  url = "";
  readonly #options: SourceOptions;
  readonly #input: Input;
  readonly #cancelled = new AbortController();
  #reader: Reader | null = null;
  #begun = false;
  #skip = 0;
  /** Where the part of the file ends that the server was asked for; `null` for all of it. */
  #bound: number | null = null;
  /** Bytes of all that the server has, if it has told. */
  #size: number | null = null;
  /** Where the file's prefix ends that the server says it is sending. */
  #prefix: number | null = null;
  #failures = 0;
  /** How far it was at the last failure: only what comes behind that makes failures forgotten. */
  #reached = 0;
  #validator: string | null = null;
  #request: Request | null = null;

  constructor(input: Input, options: SourceOptions) {
    this.#input = input;
    this.#options = options;
    if (typeof input === "string" || input instanceof URL) this.url = String(input);
  }

  /** Whether there is nothing to read: what is wanted is there, or the input has ended. */
  get isSatisfied(): boolean {
    return this.isOver || (this.expected !== null && this.received >= this.expected);
  }

  /** The next bytes; `null` at the end; `"restart"` where the file is another one now and begins anew. */
  async read(): Promise<Uint8Array | "restart" | null> {
    for (;;) {
      if (this.isSatisfied || this.#cancelled.signal.aborted) return null;
      try {
        this.#jump();
        if (!this.#reader && (await this.#open()) === "restart") return "restart";
        if (this.isOver) continue;
        const reader: Reader = this.#reader!;
        const { done, value } = await reader.read();
        // It was let go of meanwhile.
        if (reader !== this.#reader) continue;
        if (done) {
          this.#end();
          continue;
        }
        const skipped = Math.min(this.#skip, value!.byteLength);
        this.#skip -= skipped;
        if (skipped === value!.byteLength) continue;
        this.received += value!.byteLength - skipped;
        if (this.received > this.#reached) this.#failures = 0;
        return skipped ? value!.slice(skipped) : value!;
      } catch (error) {
        if (this.#cancelled.signal.aborted) return null;
        if (error instanceof HttpError && !isPassing(error.status)) throw error;
        this.#drop();
        this.#reached = Math.max(this.#reached, this.received);
        if (!this.url || ++this.#failures > (this.#options.retries ?? 5)) {
          this.#failures = 0;
          throw new ConnectionError(this.url, this.received, this.expected, error);
        }
        await pause(500 * 2 ** (this.#failures - 1), this.#cancelled.signal);
      }
    }
  }

  /** Bytes of the file from one to the one before `to`, whatever is read otherwise. */
  async part([from, to]: readonly [number, number]): Promise<Uint8Array> {
    const headers = new Headers({ Range: `bytes=${from}-${to - 1}` });
    if (this.#validator !== null) headers.set("If-Range", this.#validator);
    const response = await this.#fetch(headers);
    if (!response.ok) throw new HttpError(this.url, response.status, response.statusText);
    const bytes = new Uint8Array(await response.arrayBuffer());
    return response.status === 206 ? bytes : bytes.subarray(from, to);
  }

  /** Leaves out what is not wanted, if the connection can be taken up behind it. */
  #jump(): void {
    const hole = this.holes.find(([from, to]) => from <= this.received && to - this.received >= LEAST_HOLE);
    if (!hole || !this.url || this.#validator === null) return;
    this.#drop();
    this.received = hole[1];
  }

  /** Lets go of the connection, if it can be taken up again; else it waits. */
  rest(): void {
    if (this.url && this.#validator !== null) this.#drop();
  }

  /** Reads no further. */
  cancel(): void {
    this.#cancelled.abort();
    this.#drop();
  }

  #drop(): void {
    const reader = this.#reader;
    this.#reader = null;
    this.#skip = 0;
    Promise.resolve(reader?.cancel()).catch(() => {});
  }

  /** An answer is over: with it all that there is, or the part that was asked for. */
  #end(): void {
    const { received } = this;
    const isLast = this.#bound === null || this.#bound === this.#size;
    const sent = this.#bound ?? 0;
    const isPrefix = isLast && received >= sent && this.#mayEnd;
    const missing = Math.max(sent, isLast && !isPrefix ? (this.expected ?? 0) : 0) - received;
    if (this.url && missing > 0) throw new TypeError(`it ended ${missing} bytes early`);
    this.#reader = null;
    this.isOver = isLast;
    this.isPrefix = isPrefix;
  }

  /** Whether nothing need come behind what was received. */
  get #mayEnd(): boolean {
    return this.#options.prefix === true || this.received === this.#prefix;
  }

  async #open(): Promise<"restart" | void> {
    if (this.#begun) return this.#again();
    this.#begun = true;
    const input = await this.#input;
    if (input instanceof Uint8Array) this.#reader = readerOf([input]);
    else if (input instanceof ArrayBuffer) this.#reader = readerOf([new Uint8Array(input)]);
    else if (input instanceof Blob) this.#reader = input.stream().getReader();
    else if (input instanceof ReadableStream) this.#reader = input.getReader();
    else if (input instanceof Response) this.#take(input);
    else if (typeof input === "string" || input instanceof URL || input instanceof Request) {
      if (input instanceof Request) {
        this.url = input.url;
        this.#request = input;
      }
      return this.#again();
    } else this.#reader = readerOf(input);
  }

  /** Asks for the file from its start, or takes up a connection. */
  async #again(): Promise<"restart" | void> {
    const { received } = this;
    const headers = new Headers();
    const validator = this.#validator;
    const ranged = received > 0 ? validator !== null : this.#options.head !== undefined;
    if (ranged) {
      headers.set("Range", `bytes=${received}-${this.#last()}`);
      if (received > 0) headers.set("If-Range", validator!);
    }
    const response = await this.#fetch(headers);
    if (ranged && response.status === 206) {
      const told = /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(response.headers.get("content-range") ?? "");
      const same = received === 0 || validatorOf(response) === validator;
      if (told && same && Number(told[1]) === received && Number(told[2]) >= received) {
        this.#take(response);
        this.#bound = Number(told[2]) + 1;
        this.#size = told[3] === "*" ? null : Number(told[3]);
        return;
      }
    }
    if (ranged && (response.status === 206 || response.status === 416)) {
      // Nothing behind what was received, or something else: mostly another file, whatever the server says. Or an empty one.
      response.body?.cancel().catch(() => {});
      return this.#whole(response.status === 416 ? validator : null);
    }
    // The whole file: the same one from a server that does not know ranges, or another one.
    const same = validator !== null && validatorOf(response) === validator;
    this.#take(response);
    if (same) this.#skip = received;
    else return this.#anew();
  }

  /**
   * Asks for the whole file without conditions. Where it is `ended` still, the version with nothing behind what was received, either that is the
   * end or it fails.
   */
  async #whole(ended: string | null): Promise<"restart" | void> {
    const response = await this.#fetch(new Headers());
    const isSame = ended !== null && response.ok && validatorOf(response) === ended;
    this.#take(response);
    if (!isSame) return this.#anew();
    if (!this.#mayEnd) throw new TypeError(`the server has nothing behind byte ${this.received}`);
    this.#drop();
    this.isOver = this.isPrefix = true;
  }

  #anew(): "restart" | void {
    if (this.received === 0) return;
    this.received = 0;
    this.expected = null;
    this.holes = [];
    return "restart";
  }

  /** The last byte to ask for: of what is wanted, up to where nothing is, or until that is known, a little more than before. Empty for all of them. */
  #last(): number | "" {
    const { head } = this.#options;
    const hole = this.holes.find(([from, to]) => from > this.received && to - from >= LEAST_HOLE);
    if (this.expected !== null) return Math.min(this.expected, hole?.[0] ?? Infinity) - 1;
    return head === undefined ? "" : this.received + Math.max(head, 3 * this.received) - 1;
  }

  async #fetch(headers: Headers): Promise<Response> {
    const { request } = this.#options;
    const init: RequestInit = { ...request, signal: this.#cancelled.signal };
    new Headers(this.#request?.headers).forEach((value, name) => headers.set(name, value));
    new Headers(request?.headers).forEach((value, name) => headers.set(name, value));
    const { fetch = globalThis.fetch } = this.#options;
    return fetch(this.#request?.clone() ?? this.url, { ...init, headers });
  }

  #take(response: Response): void {
    this.url ||= response.url;
    if (!response.ok) {
      response.body?.cancel().catch(() => {});
      throw new HttpError(this.url, response.status, response.statusText);
    }
    this.#bound = this.#size = null;
    this.#prefix = prefixOf(response);
    this.#validator = validatorOf(response);
    this.#reader = response.body?.getReader() ?? readerOf([]);
  }
}

/** Bytes that are read rather than asked for anew behind them. */
const LEAST_HOLE = 1 << 16;

/** What tells one version of a file from another: a strong ETag, or else the date. */
function validatorOf(response: Response): string | null {
  const tag = response.headers.get("etag");
  return tag && !tag.startsWith("W/") ? tag : tag ? null : response.headers.get("last-modified");
}

/** Where the prefix of a file ends that an answer is, if it says that it is one (spec §12.4). */
function prefixOf(response: Response): number | null {
  const told = /^0-(\d+)$/.exec(response.headers.get("unweld-bytes") ?? "");
  return told && Number(told[1]);
}

/** Whether the same request may go well later. */
function isPassing(status: number): boolean {
  return status === 408 || status === 425 || status === 429 || status >= 500;
}

function readerOf(input: AsyncIterable<Uint8Array> | Iterable<Uint8Array>): Reader {
  const iterator = Symbol.asyncIterator in input ? input[Symbol.asyncIterator]() : input[Symbol.iterator]();
  return {
    read: async () => iterator.next(),
    cancel: async () => iterator.return?.(),
  };
}

function pause(milliseconds: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      signal.removeEventListener("abort", done);
      resolve();
    };
    const timer = setTimeout(done, milliseconds);
    signal.addEventListener("abort", done);
  });
}
