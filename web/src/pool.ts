// Workers, shared by meshes; each mesh stays with the one it was given.

import { errorOf, LimitError, type Fault } from "./errors.js";
import { compile, isCompiled } from "./module.js";
import { unbundled } from "./places.js";
import { Session, type Decoding } from "./session.js";
import type { Contents, Delta, Settings } from "./types.js";
import type { Answer, Call } from "./worker.js";

/** A number of workers, made when they are wanted. */
export class WorkerPool {
  /** Most workers; 0 decodes on the calling thread. */
  limit: number;
  readonly #url: string | URL | undefined;
  #workers: Remote[] = [];

  /** `url`: where `worker.js` is, if not beside the script. */
  constructor(limit: number = usual(), url?: string | URL) {
    this.limit = limit;
    this.#url = url;
  }

  /** Starts a worker and has the module compiled, before there is anything to decode; `wasm`: where the module is, if not beside the script. */
  async preload(wasm?: string | URL): Promise<void> {
    const decoding = this.open(wasm ? { wasm } : {});
    // The first call is answered when there is a decoder.
    await decoding.want({}).finally(() => decoding.close());
  }

  /** Whether a mesh that is opened now is decoded as soon as bytes come. */
  isReady(settings: Settings): boolean {
    return isCompiled(this.#place(settings));
  }

  /** A decoder in the worker that has the fewest. */
  open(settings: Settings): Decoding {
    if (this.limit < 1 || typeof Worker === "undefined") return new Session(settings);
    this.#workers = this.#workers.filter((worker) => !worker.dead);
    let least = this.#workers.reduce<Remote | null>((a, b) => (a && a.load <= b.load ? a : b), null);
    if (!least || (least.load > 0 && this.#workers.length < this.limit)) {
      least = new Remote(this.#url);
      this.#workers.push(least);
    }
    return least.open(settings, compile(this.#place(settings)));
  }

  /** Where the module is: beside the worker, if that is said to be somewhere. */
  #place({ wasm }: Settings): string | URL | undefined {
    const base = globalThis.document?.baseURI ?? globalThis.location?.href;
    if (wasm) return base === undefined ? wasm : new URL(wasm, base);
    return this.#url && new URL("unweld.wasm", new URL(this.#url, base));
  }

  /** Ends all workers, and with them what they decode. */
  dispose(): void {
    for (const worker of this.#workers.splice(0)) worker.end(new Error("the workers have been ended"));
  }
}

/** A worker and what it is asked. */
class Remote {
  load = 0;
  dead = false;
  readonly #worker: Worker;
  readonly #calls = new Map<number, { resolve: (value: never) => void; reject: (error: unknown) => void }>();
  #next = 0;

  constructor(url: string | URL | undefined) {
    const address = url ?? unbundled(import.meta.url, "worker.js");
    this.#worker = started(address);
    this.#worker.onmessage = ({ data: { call, value, error } }: MessageEvent<Answer>) => {
      const waiting = this.#calls.get(call);
      this.#calls.delete(call);
      if (error) waiting?.reject(revived(error));
      else waiting?.resolve(value as never);
    };
    this.#worker.onerror = ({ message }) => this.end(new Error(`${address ?? beside()}: the worker failed: ${message ?? "it cannot be loaded"}`));
  }

  /**
   * `module`: compiled on this thread, once for all workers, and asked for before the worker's script has come. Until it is there nothing is sent; where it
   * cannot be had here, because the page's policy forbids it, the worker tries itself.
   */
  open(settings: Settings, module: Promise<WebAssembly.Module>): Decoding {
    const session = ++sessions;
    const compiled = module.catch(() => null);
    const call = <T>(method: Call["method"], argument?: unknown, transfer?: Transferable[]) =>
      this.#call<T>({ session, call: this.#next++, method, argument }, transfer ?? [], compiled);
    this.load++;
    const wasm = settings.wasm && String(new URL(settings.wasm, globalThis.document?.baseURI ?? location.href));
    call("open", wasm ? { ...settings, wasm } : settings).catch(() => {});
    let open = true;
    // Bytes on their way to the worker, and whether it has told where what is wanted ends.
    let [ahead, known] = [0, false];
    let contents: Contents | null = null;
    const whole = (delta: Delta): Delta => ({ ...delta, contents: (contents = delta.contents ?? contents!) });
    return {
      add: (number, bytes) => call("add", [number, bytes]),
      push: (bytes, at) => {
        // A piece of a larger buffer is copied: the rest of the buffer may be someone's.
        const own = bytes.byteLength === bytes.buffer.byteLength ? bytes : bytes.slice();
        const length = own.byteLength;
        const answer = call<number | null>("push", [own, at], [own.buffer]);
        ahead += length;
        const answered = answer.finally(() => (ahead -= length));
        if (!known || ahead >= MOST_AHEAD) {
          return answered.then((end) => {
            known = end !== null;
            return end;
          });
        }
        // What is wrong, the next call says too.
        answered.catch(() => {});
        return Promise.resolve(null);
      },
      want: (until) => call<Contents | null>("want", until),
      end: (ended) => call("end", ended),
      restart: () => {
        known = false;
        return call("restart");
      },
      next: (pace) => call<Delta | null>("next", pace).then((delta) => delta && whole(delta)),
      show: (level) => call<Delta>("show", level).then(whole),
      close: () => {
        if (!open) return;
        open = false;
        this.load--;
        call("close").catch(() => {});
      },
    };
  }

  end(error: Error): void {
    this.dead = true;
    this.#worker.terminate();
    for (const { reject } of this.#calls.values()) reject(error);
    this.#calls.clear();
  }

  #call<T>(message: Call, transfer: Transferable[], compiled: Promise<WebAssembly.Module | null>): Promise<T> {
    if (this.dead) return Promise.reject(new Error("the worker has been ended"));
    return new Promise<T>((resolve, reject) => {
      this.#calls.set(message.call, { resolve, reject });
      void compiled.then((module) => this.#worker.postMessage(message.method === "open" ? { ...message, module } : message, transfer));
    });
  }
}

/** Bytes handed over without waiting: a slow line brings them in small pieces, and the worker answers between two slices of work. */
const MOST_AHEAD = 1 << 18;
let sessions = 0;

/** Bundlers look for this expression, and put the file's address there. */
function beside(): string {
  return String(new URL("./worker.js", import.meta.url));
}

function started(url: string | URL | null): Worker {
  try {
    return url
      ? new Worker(url, { type: "module", name: "unweld" })
      : new Worker(new URL("./worker.js", import.meta.url), { type: "module", name: "unweld" });
  } catch {
    // A script of another origin, a CDN's say, cannot be a worker, but a worker may import it.
    const text = `import ${JSON.stringify(String(url ?? beside()))};`;
    const own = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    return new Worker(own, { type: "module", name: "unweld" });
  }
}

/** One core is left to the page. */
function usual(): number {
  return Math.max(1, Math.min(4, (globalThis.navigator?.hardwareConcurrency ?? 2) - 1));
}

/** An error as the worker threw it: classes do not come through messages. */
function revived(error: Record<string, unknown>): Error {
  if (error.name === "FormatError") return errorOf({ ...(error as unknown as Fault), kind: "format" });
  if (error.name === "LimitError") return new LimitError(String(error.message));
  return new Error(String(error.message));
}
