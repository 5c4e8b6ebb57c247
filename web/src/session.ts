// One mesh on its way from bytes to deltas, on whichever thread.

import { errorOf, type Fault } from "./errors.js";
import { compile, Decoder } from "./module.js";
import type { Contents, Delta, Level, Metadata, Residue, Settings } from "./types.js";

/** What decodes a mesh: a session on this thread, or one in a worker. */
export interface Decoding {
  /** Hands over the next bytes; resolves as soon as there is room for more. */
  push(bytes: Uint8Array): Promise<void>;
  /** Says whether more bytes will come; where they do not, for now or for good, `next` does not wait for them. */
  end(ended: Ended): Promise<void>;
  /** Forgets all bytes: the file begins anew. */
  restart(): Promise<void>;
  /** What has changed, as soon as something has; `null` where nothing more will. */
  next(): Promise<Delta | null>;
  /** Shows a level that has been decoded, or with `null` the finest. Until that is shown again, decoding rests. */
  show(level: number | null): Promise<Delta>;
  close(): void;
}

export type Ended = "no" | "for now" | "for good";

export class Session implements Decoding {
  readonly #settings: Settings;
  #decoder: Promise<Decoder>;
  #queue: Uint8Array[] = [];
  #queued = 0;
  #ended: Ended = "no";
  #finished = false;
  #lowered: number[] = [];
  #fault: Error | null = null;
  #bytes = 0;
  #contents: Contents | null = null;
  #level: Level | null = null;
  #residue: Residue | null = null;
  #metadata: Metadata | null = null;
  #complete = false;
  #wake: (() => void)[] = [];

  constructor(settings: Settings) {
    this.#settings = settings;
    this.#decoder = this.#new();
  }

  async push(bytes: Uint8Array): Promise<void> {
    this.#queue.push(bytes);
    this.#queued += bytes.byteLength;
    this.#ended = "no";
    this.#stir();
    while (this.#queued > MOST_QUEUED) await this.#stirred();
  }

  async end(ended: Ended): Promise<void> {
    this.#ended = ended;
    this.#stir();
  }

  async restart(): Promise<void> {
    this.#decoder = this.#new();
    this.#queue = [];
    this.#queued = this.#bytes = 0;
    this.#ended = "no";
    this.#lowered = [];
    this.#contents = this.#level = this.#residue = this.#metadata = this.#fault = null;
    this.#complete = this.#finished = false;
    this.#stir();
  }

  async next(): Promise<Delta | null> {
    for (;;) {
      if (this.#fault) throw this.#fault;
      const decoder = await this.#decoder;
      if (this.#lowered.length === 0) {
        const delta = this.#decode(decoder);
        if (delta) return delta;
        if (this.#fault) continue;
        if (this.#complete) return null;
        if (this.#ended === "for now") return null;
        if (this.#ended === "for good") {
          if (this.#finished || decoder.finish()) return null;
          this.#note(decoder);
          continue;
        }
      }
      await this.#stirred();
    }
  }

  async show(level: number | null): Promise<Delta> {
    const decoder = await this.#decoder;
    const target = level ?? -1;
    const at = () => this.#lowered[this.#lowered.length - 1] ?? this.#level?.level ?? Infinity;
    while (at() < target) {
      const reached = decoder.coarsen();
      if (reached < 0) break;
      this.#lowered.push(reached);
    }
    while (this.#lowered.length > 0 && at() > target) {
      decoder.restore();
      this.#lowered.pop();
    }
    this.#stir();
    return this.#delta(decoder, []);
  }

  close(): void {
    this.#queue = [];
    this.#queued = 0;
    this.#ended = "for now";
    this.#stir();
  }

  async #new(): Promise<Decoder> {
    return new Decoder(await compile(this.#settings.wasm), this.#settings);
  }

  /** Decodes until enough has changed for one delta, or bytes are needed. */
  #decode(decoder: Decoder): Delta | null {
    const begin = performance.now();
    const levels: Level[] = [];
    let any = false;
    while (decoder.waiting() < MOST_NUMBERS && performance.now() - begin < MOST_MILLISECONDS) {
      const told = decoder.poll();
      if (told) {
        any = true;
        levels.push(...this.#note(decoder));
        if (told === "fault") break;
        continue;
      }
      const bytes = this.#queue.shift();
      if (!bytes) break;
      decoder.push(bytes);
      this.#queued -= bytes.byteLength;
      this.#bytes += bytes.byteLength;
      this.#stir();
    }
    return any && this.#contents ? this.#delta(decoder, levels) : null;
  }

  /** Takes note of what has happened; returns the levels that are complete. */
  #note(decoder: Decoder): Level[] {
    const levels: Level[] = [];
    for (const report of decoder.report()) {
      const { type, ...what } = report;
      if (type === "contents") this.#contents = what as unknown as Contents;
      else if (type === "level") levels.push((this.#level = what as unknown as Level));
      else if (type === "residue") this.#residue = what as unknown as Residue;
      else if (type === "metadata") this.#metadata = what as unknown as Metadata;
      else if (type === "end") this.#complete = true;
      else if (type === "fault") this.#fault = errorOf(what as unknown as Fault);
    }
    return levels;
  }

  #delta(decoder: Decoder, levels: Level[]): Delta {
    const contents = this.#contents;
    if (!contents) throw new Error("there is no mesh before the table of contents");
    const changes = decoder.take();
    const lowered = this.#lowered[this.#lowered.length - 1];
    return {
      vertices: changes.vertices,
      triangles: changes.triangles,
      firstVertex: changes.firstVertex,
      appended: { position: changes.positions, normal: changes.normals },
      from: changes.from,
      changed: {
        position: { vertices: changes.moved, values: changes.movedPositions },
        normal: { vertices: changes.turned, values: changes.turnedNormals },
      },
      firstTriangle: changes.firstTriangle,
      indices: changes.indices,
      rewritten: { triangles: changes.rewritten, indices: changes.rewrittenIndices },
      contents,
      level: lowered === undefined ? this.#level : (contents.levels[lowered] ?? null),
      levels,
      bytes: Math.min(this.#bytes, contents.wanted.end),
      residue: this.#residue,
      metadata: this.#metadata,
      complete: this.#complete,
    };
  }

  #stirred(): Promise<void> {
    return new Promise((resolve) => this.#wake.push(resolve));
  }

  #stir(): void {
    for (const wake of this.#wake.splice(0)) wake();
  }
}

/** The buffers of a delta, which can be transferred. */
export function buffersOf(delta: Delta): ArrayBuffer[] {
  const arrays = [
    ...Object.values(delta.appended),
    ...Object.values(delta.changed).flatMap(({ vertices, values }) => [vertices, values]),
    delta.from,
    delta.indices,
    delta.rewritten.triangles,
    delta.rewritten.indices,
  ];
  return arrays.map((array) => array.buffer as ArrayBuffer);
}

/** Bytes that wait to be decoded before no more are read. */
const MOST_QUEUED = 4 << 20;
/** Numbers that one delta holds, about: the page takes a millisecond or two to apply them. */
const MOST_NUMBERS = 400_000;
/** How long changes are gathered, while there are bytes. */
const MOST_MILLISECONDS = 60;
