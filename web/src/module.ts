// The WebAssembly module: one instance a mesh, so that its memory goes with it.

import { unbundled } from "./places.js";
import type { Settings, Until } from "./types.js";

interface Exports {
  memory: WebAssembly.Memory;
  unweld_new(settings: number, want: number, value: number): void;
  unweld_want(want: number, value: number): void;
  unweld_room(length: number): number;
  unweld_push(at: number, length: number): void;
  unweld_skip(length: number): void;
  unweld_add(number: number, length: number): number;
  unweld_resource(number: number): number;
  unweld_poll(): number;
  unweld_finish(): number;
  unweld_waiting(): number;
  unweld_terms(): number;
  unweld_take(): number;
  unweld_report(): number;
  unweld_coarsen(): number;
  unweld_restore(): number;
}

/** What has changed, in arrays of its own. The module tells which fields there are; a test compares these with them. */
export interface Changes {
  vertices: number;
  triangles: number;
  firstVertex: number;
  firstTriangle: number;
  positions: Float32Array;
  from: Float32Array;
  normals: Float32Array;
  moved: Uint32Array;
  movedPositions: Float32Array;
  turned: Uint32Array;
  turnedNormals: Float32Array;
  indices: Uint32Array;
  rewritten: Uint32Array;
  rewrittenIndices: Uint32Array;
  jump: number;
  alive: Uint32Array;
  firstTold: number;
  firstWedge: number;
  wedges: Uint32Array;
  wedgeIndices: Uint32Array;
  rewrittenWedges: Uint32Array;
  values: Uint8Array;
}

/** Compiles the module, once for each address. */
export function compile(url: string | URL | undefined): Promise<WebAssembly.Module> {
  const address = addressOf(url);
  let module = modules.get(address);
  if (!module) {
    module = load(address).catch((error: unknown) => {
      throw new Error(`${address}: ${error instanceof Error ? error.message : String(error)}`, { cause: error });
    });
    modules.set(address, module);
    module.then(
      () => compiled.add(address),
      () => modules.delete(address),
    );
  }
  return module;
}

/** Takes the module of an address from another thread that has compiled it. */
export function provide(url: string | URL | undefined, module: WebAssembly.Module): void {
  modules.set(addressOf(url), Promise.resolve(module));
}

/** Whether the module is there: nothing is waited for. */
export function isCompiled(url: string | URL | undefined): boolean {
  return compiled.has(addressOf(url));
}

function addressOf(url: string | URL | undefined): string {
  return String(url ?? unbundled(import.meta.url, "unweld.wasm") ?? new URL("./unweld.wasm", import.meta.url));
}

/** What numbers mean to the module, as it tells it: names by number, or by bit, and name and kind of each field of `Changes`. */
interface Terms {
  settings: ("relative" | "levels" | "jumps" | "resources" | "ownNormals")[];
  wants: string[];
  outcomes: string[];
  fields: [name: string, kind: keyof typeof READ][];
}

/** A decoder. Its methods are those of `unweld::wasm::Client`. */
export class Decoder {
  readonly #exports: Exports;
  readonly #terms: Terms;

  constructor(module: WebAssembly.Module, settings: Settings) {
    this.#exports = new WebAssembly.Instance(module).exports as unknown as Exports;
    this.#terms = this.#told(this.#exports.unweld_terms());
    const set = this.#terms.settings.reduce((bits, name, k) => bits | (settings[name] ? 1 << k : 0), 0);
    this.#exports.unweld_new(set, ...this.#wanted(settings.until ?? {}));
  }

  want(until: Until): void {
    this.#exports.unweld_want(...this.#wanted(until));
  }

  /** Bytes of the file from byte `at` on. */
  push(at: number, bytes: Uint8Array): void {
    this.#put(bytes);
    this.#exports.unweld_push(at, bytes.byteLength);
  }

  /** Leaves out resources. */
  skip(numbers: readonly number[]): void {
    const bytes = new DataView(new ArrayBuffer(4 * numbers.length));
    numbers.forEach((number, k) => bytes.setUint32(4 * k, number, true));
    this.#put(new Uint8Array(bytes.buffer));
    this.#exports.unweld_skip(bytes.byteLength);
  }

  /** Adds a resource that was left out; `false` where there is a fault to report. */
  add(number: number, bytes: Uint8Array): boolean {
    this.#put(bytes);
    return this.#terms.outcomes[this.#exports.unweld_add(number, bytes.byteLength)] !== "fault";
  }

  /** A resource that is whole. */
  resource(number: number): Uint8Array<ArrayBuffer> {
    const at = this.#exports.unweld_resource(number) >>> 0;
    return READ["u8[]"](this.#exports.memory.buffer, at);
  }

  #put(bytes: Uint8Array): void {
    const room = this.#exports.unweld_room(bytes.byteLength) >>> 0;
    new Uint8Array(this.#exports.memory.buffer, room, bytes.byteLength).set(bytes);
  }

  /** `true` where there was an event, `false` where more bytes are needed, `"fault"` where there is a fault to report. */
  poll(): boolean | "fault" {
    const outcome = this.#terms.outcomes[this.#exports.unweld_poll()];
    return outcome === "fault" ? outcome : outcome === "event";
  }

  finish(): boolean {
    return this.#terms.outcomes[this.#exports.unweld_finish()] !== "fault";
  }

  /** About how many numbers `take` would return. */
  waiting(): number {
    return this.#exports.unweld_waiting() >>> 0;
  }

  take(): Changes {
    const at = this.#exports.unweld_take() >>> 0;
    const { buffer } = this.#exports.memory;
    const fields = this.#terms.fields.map(([name, kind], k) => [name, READ[kind](buffer, at + 8 * k)]);
    return Object.fromEntries(fields) as Changes;
  }

  report(): { type: string }[] {
    return this.#told(this.#exports.unweld_report());
  }

  /** The level reached, or -1. */
  coarsen(): number {
    return this.#exports.unweld_coarsen();
  }

  /** The level reached, or -1. */
  restore(): number {
    return this.#exports.unweld_restore();
  }

  #wanted(until: Until): [want: number, value: number] {
    const [name, value] = wanted(until);
    return [this.#terms.wants.indexOf(name), value];
  }

  /** What is told as JSON: address and length of its text are at `at`. */
  #told<T>(at: number): T {
    const { buffer } = this.#exports.memory;
    return JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, ...words(buffer, at >>> 0))));
  }
}

/** A field of `Changes` by its kind, from the two words at `at`. */
const READ = {
  u32: (buffer: ArrayBuffer, at: number) => words(buffer, at)[0],
  f32: (buffer: ArrayBuffer, at: number) => new Float32Array(buffer, at, 1)[0],
  "u32[]": (buffer: ArrayBuffer, at: number) => new Uint32Array(buffer, ...words(buffer, at)).slice(),
  "f32[]": (buffer: ArrayBuffer, at: number) => new Float32Array(buffer, ...words(buffer, at)).slice(),
  "u8[]": (buffer: ArrayBuffer, at: number) => new Uint8Array(buffer, ...words(buffer, at)).slice() as Uint8Array<ArrayBuffer>,
};

/** Two words: address and length, mostly. */
function words(buffer: ArrayBuffer, at: number): [number, number] {
  const [first, second] = new Uint32Array(buffer, at, 2);
  return [first!, second!];
}

const modules = new Map<string, Promise<WebAssembly.Module>>();
const compiled = new Set<string>();

/** What Node.js has, from 20.16 on: no import, which bundlers would follow. */
interface Node {
  process: { getBuiltinModule?(name: string): { readFile(url: URL): Promise<Uint8Array<ArrayBuffer>> } };
}

async function load(address: string): Promise<WebAssembly.Module> {
  const files = address.startsWith("file:") ? (globalThis as Partial<Node>).process?.getBuiltinModule?.("node:fs/promises") : undefined;
  if (files) return WebAssembly.compile(await files.readFile(new URL(address)));
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
  // Servers that do not know the type of .wasm are common.
  const streams = response.headers.get("content-type")?.startsWith("application/wasm");
  return streams ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

/** What is wanted, in the module's words. */
function wanted(until: Until): [want: string, value: number] {
  if (until.level !== undefined) return ["level", until.level];
  if (until.error !== undefined) return [until.measure ?? "max", until.error];
  return until.triangles !== undefined ? ["triangles", until.triangles] : ["all", 0];
}
