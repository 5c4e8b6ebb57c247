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
}

interface Reader {
  read(): Promise<{ done?: boolean | undefined; value?: Uint8Array | undefined }>;
  cancel(): Promise<unknown>;
}

/** Reads an input from its first byte. */
export class Source {
  /** Bytes returned by `read` since the last `"restart"`. */
  received = 0;
  /** Bytes that there must be, once known: less is a connection lost. */
  expected: number | null = null;
  /** Where to ask again; empty where that is impossible. */
  url = "";
  readonly #options: SourceOptions;
  readonly #input: Input;
  #reader: Reader | null = null;
  #begun = false;
  #skip = 0;
  #failures = 0;
  #validator: string | null = null;
  #request: Request | null = null;

  constructor(input: Input, options: SourceOptions) {
    this.#input = input;
    this.#options = options;
    if (typeof input === "string" || input instanceof URL) this.url = String(input);
  }

  /** The next bytes; `null` at the end; `"restart"` where the file is another one now and begins anew. */
  async read(): Promise<Uint8Array | "restart" | null> {
    for (;;) {
      this.#options.signal?.throwIfAborted();
      try {
        if (!this.#reader && (await this.#open()) === "restart") return "restart";
        const { done, value } = await this.#reader!.read();
        if (done) {
          if (!this.url || this.expected === null || this.received >= this.expected) return null;
          throw new TypeError(`it ended ${this.expected - this.received} bytes early`);
        }
        const skipped = Math.min(this.#skip, value!.byteLength);
        this.#skip -= skipped;
        if (skipped === value!.byteLength) continue;
        this.#failures = 0;
        this.received += value!.byteLength - skipped;
        return skipped ? value!.slice(skipped) : value!;
      } catch (error) {
        this.#options.signal?.throwIfAborted();
        if (error instanceof HttpError && !isPassing(error.status)) throw error;
        this.#drop();
        if (!this.url || ++this.#failures > (this.#options.retries ?? 5)) {
          this.#failures = 0;
          throw new ConnectionError(this.url, this.received, error);
        }
        await pause(500 * 2 ** (this.#failures - 1), this.#options.signal);
      }
    }
  }

  /** Reads no further. */
  cancel(): void {
    this.#drop();
  }

  #drop(): void {
    const reader = this.#reader;
    this.#reader = null;
    this.#skip = 0;
    Promise.resolve(reader?.cancel()).catch(() => {});
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
      this.#take(await this.#fetch(new Headers()));
    } else this.#reader = readerOf(input);
  }

  /** Takes up a broken connection. */
  async #again(): Promise<"restart" | void> {
    const { received } = this;
    const headers = new Headers();
    const validator = this.#validator;
    if (received > 0 && validator) {
      headers.set("Range", `bytes=${received}-`);
      headers.set("If-Range", validator);
    }
    const response = await this.#fetch(headers);
    if (response.status === 206) {
      const [, first] = /^bytes (\d+)-/.exec(response.headers.get("content-range") ?? "") ?? [];
      if (validatorOf(response) === validator && Number(first) === received) return this.#take(response);
      await response.body?.cancel();
      this.#validator = null;
      return this.#again();
    }
    if (response.status === 416 && validator !== null) {
      // Shorter than what was received: another file, whatever the server says.
      await response.body?.cancel();
      this.#validator = null;
      return this.#again();
    }
    // The whole file: the same one from a server that does not know ranges, or another one.
    const same = validator !== null && validatorOf(response) === validator;
    this.#take(response);
    if (same) this.#skip = received;
    else if (received > 0) {
      this.received = 0;
      this.expected = null;
      return "restart";
    }
  }

  async #fetch(headers: Headers): Promise<Response> {
    const { request, signal } = this.#options;
    const init: RequestInit = { ...request, signal: signal ?? null };
    new Headers(this.#request?.headers).forEach((value, name) => headers.set(name, value));
    new Headers(request?.headers).forEach((value, name) => headers.set(name, value));
    return fetch(this.#request?.clone() ?? this.url, { ...init, headers });
  }

  #take(response: Response): void {
    this.url ||= response.url;
    if (!response.ok) {
      response.body?.cancel().catch(() => {});
      throw new HttpError(this.url, response.status, response.statusText);
    }
    this.#validator = validatorOf(response);
    this.#reader = response.body?.getReader() ?? readerOf([]);
  }
}

/** What tells one version of a file from another: a strong ETag, or else the date. */
function validatorOf(response: Response): string | null {
  const tag = response.headers.get("etag");
  return tag && !tag.startsWith("W/") ? tag : tag ? null : response.headers.get("last-modified");
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

function pause(milliseconds: number, signal: AbortSignal | undefined): Promise<void> {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      signal?.removeEventListener("abort", done);
      resolve();
    };
    const timer = setTimeout(done, milliseconds);
    signal?.addEventListener("abort", done);
  });
}
