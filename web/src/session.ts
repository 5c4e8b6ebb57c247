// One mesh on its way from bytes to deltas, on whichever thread.

import { attributesOf } from "./attributes.js";
import { unwanted, type Document } from "./document.js";
import { breath } from "./breath.js";
import { errorOf, type Fault } from "./errors.js";
import { compile, Decoder } from "./module.js";
import type { Attributes, Contents, Delta, Level, Metadata, Numbers, Residue, Resource, Settings, Until } from "./types.js";

/** What decodes a mesh: a session on this thread, or one in a worker. */
export interface Decoding {
  /** Hands over bytes of the file from byte `at` on; resolves as soon as there is room for more: with the byte at which what is wanted ends, if known. */
  push(bytes: Uint8Array, at: number): Promise<number | null>;
  /** Hands over a resource that was left out: all bytes that it takes in the file. */
  add(number: number, bytes: Uint8Array): Promise<void>;
  /** Wants something else from now on; resolves with what is then told, if the file is known. */
  want(until: Until): Promise<Contents | null>;
  /** Says whether more bytes will come; where they do not, for now or for good, `next` does not wait for them. */
  end(ended: Ended): Promise<void>;
  /** Forgets all bytes: the file begins anew. */
  restart(): Promise<void>;
  /**
   * What has changed, as soon as something has, but not sooner than `pace` milliseconds after the last time, unless that is all; `null` where nothing more
   * will.
   */
  next(pace: number): Promise<Delta | null>;
  /** Shows a level that has been decoded, or with `null` the finest. Until that is shown again, decoding rests. */
  show(level: number | null): Promise<Delta>;
  close(): void;
}

/** `"prefix"`: for good, and what there is of the file is all that there was to be. */
export type Ended = "no" | "for now" | "for good" | "prefix";

export class Session implements Decoding {
  #settings: Settings;
  #decoder: Promise<Decoder>;
  #queue: { bytes: Uint8Array; at: number }[] = [];
  #queued = 0;
  /** Whether all bytes there are have been decoded. */
  #dry = true;
  #ended: Ended = "no";
  #working = false;
  /** Levels left by `show`, that shown last. */
  #lowered: number[] = [];
  #fault: Error | null = null;
  /** Bytes given to the decoder, and those of them that it was to decode. */
  #bytes = 0;
  #decoded = 0;
  #contents: Contents | null = null;
  #level: Level | null = null;
  #residue: Residue | null = null;
  #metadata: Metadata | null = null;
  #complete = false;
  /** Whether it has been told that the file ends as a prefix. */
  #isPrefix = false;
  /** Whether anything has happened since the last delta, and the levels completed since. */
  #any = false;
  #levels: Level[] = [];
  #resources: Resource[] = [];
  #document: Document | null = null;
  /** Resources that are left out. */
  #skipped = new Set<number>();
  #wake: (() => void)[] = [];
  /** Deltas made ahead of `next`, and when it was answered last. */
  #pieces: Delta[] = [];
  #told = -Infinity;
  readonly #most: number;

  constructor(settings: Settings) {
    this.#settings = settings;
    this.#most = Math.min(settings.most ?? MOST_NUMBERS, MOST_NUMBERS);
    this.#decoder = this.#new();
  }

  async push(bytes: Uint8Array, at: number): Promise<number | null> {
    for (let from = 0; from < bytes.byteLength; from += PIECE) this.#queue.push({ bytes: bytes.subarray(from, from + PIECE), at: at + from });
    this.#queued += bytes.byteLength;
    this.#dry = false;
    this.#ended = "no";
    this.#stir();
    const waits = () => (this.#contents ? this.#queued > MOST_QUEUED && !this.#isSatisfied() : !this.#dry && !this.#fault);
    while (waits()) await this.#stirred();
    return this.#contents?.wanted.end ?? null;
  }

  async want(until: Until): Promise<Contents | null> {
    this.#settings = { ...this.#settings, until };
    this.#isPrefix = false;
    const decoder = await this.#current();
    this.#count();
    decoder.want(until);
    this.#skip(decoder);
    this.#note(decoder);
    this.#dry = false;
    this.#stir();
    return this.#contents;
  }

  async add(number: number, bytes: Uint8Array): Promise<void> {
    const decoder = await this.#current();
    if (decoder.add(number, bytes)) this.#skipped.delete(number);
    this.#any = true;
    this.#note(decoder);
    this.#stir();
  }

  async end(ended: Ended): Promise<void> {
    this.#ended = ended;
    this.#stir();
  }

  async restart(): Promise<void> {
    this.#decoder = this.#new();
    this.#queue = [];
    this.#queued = this.#bytes = this.#decoded = 0;
    this.#ended = "no";
    this.#lowered = [];
    this.#levels = [];
    this.#resources = [];
    this.#pieces = [];
    this.#document = null;
    this.#skipped.clear();
    this.#contents = this.#level = this.#residue = this.#metadata = this.#fault = null;
    this.#complete = this.#any = this.#isPrefix = false;
    this.#dry = true;
    this.#stir();
  }

  async next(pace: number): Promise<Delta | null> {
    for (;;) {
      const decoder = await this.#current();
      const isOver = this.#complete || this.#fault || (this.#dry && this.#ended !== "no");
      if (this.#pieces.length > 0) {
        const early = isOver || this.#isFull() ? 0 : this.#told + pace - performance.now();
        if (early > 0) {
          await this.#stirred(early);
          continue;
        }
        const piece = this.#pieces.shift()!;
        this.#told = performance.now();
        this.#stir();
        return { ...piece, more: this.#pieces.length > 0 || (this.#any && this.#lowered.length === 0) };
      }
      if (this.#lowered.length === 0) {
        if (this.#any && this.#contents) {
          const isAll = isOver || decoder.waiting() >= this.#most;
          const early = isAll ? 0 : this.#told + pace - performance.now();
          if (early > 0) {
            await this.#stirred(early);
            continue;
          }
          this.#told = performance.now();
          return this.#delta(decoder);
        }
        if (this.#fault) throw this.#fault;
        if (this.#complete) return null;
        if (this.#dry && this.#ended === "for now") return null;
        if (this.#dry && this.#ended === "prefix" && this.#level) {
          if (this.#isPrefix) return null;
          this.#isPrefix = true;
          return this.#delta(decoder);
        }
        if (this.#dry && (this.#ended === "for good" || this.#ended === "prefix")) {
          if (decoder.finish()) return null;
          this.#note(decoder);
          continue;
        }
      }
      await this.#stirred();
    }
  }

  async show(level: number | null): Promise<Delta> {
    const decoder = await this.#current();
    const target = level ?? -1;
    const at = () => this.#lowered[this.#lowered.length - 1] ?? this.#level?.level ?? Infinity;
    let isOther = false;
    while (at() < target) {
      const reached = decoder.coarsen();
      if (reached < 0) break;
      this.#lowered.push(reached);
      isOther = true;
    }
    while (this.#lowered.length > 0 && at() > target) {
      decoder.restore();
      this.#lowered.pop();
      isOther = true;
    }
    // Members of a set have attributes of their own.
    this.#note(decoder);
    this.#stir();
    const piece = isOther ? undefined : this.#pieces.shift();
    if (piece) return piece;
    // All is new in what follows; of the deltas made ahead only what is told once is of use.
    const missed = this.#pieces.splice(0);
    this.#levels.unshift(...missed.flatMap(({ levels }) => levels));
    this.#resources.unshift(...missed.flatMap(({ resources }) => resources));
    return this.#delta(decoder);
  }

  close(): void {
    this.#queue = [];
    this.#queued = 0;
    this.#dry = true;
    this.#ended = "for now";
    this.#stir();
  }

  /** The decoder; not one that `restart` has replaced meanwhile. */
  async #current(): Promise<Decoder> {
    for (;;) {
      const decoder = this.#decoder;
      const ready = await decoder;
      if (decoder === this.#decoder) return ready;
    }
  }

  #isSatisfied(): boolean {
    return this.#contents !== null && this.#bytes >= this.#contents.wanted.end;
  }

  /** Whether as much has been made ahead as there may be; of small pieces, many of which are applied before a picture, twice as much. */
  #isFull(): boolean {
    return (this.#pieces.length + 2) * this.#most > (this.#most < MOST_NUMBERS ? 2 : 1) * MOST_NUMBERS;
  }

  #count(): void {
    this.#decoded = Math.max(this.#decoded, Math.min(this.#bytes, this.#contents?.wanted.end ?? 0));
  }

  #new(): Promise<Decoder> {
    const decoder = compile(this.#settings.wasm).then((module) => new Decoder(module, this.#settings));
    decoder.catch(() => {});
    return decoder;
  }

  /** Decodes ahead of `next`, a slice at a time, until there is enough for one delta: what comes late to be shown is shown together. */
  async #work(): Promise<void> {
    if (this.#working) return;
    this.#working = true;
    try {
      for (;;) {
        const decoder = await this.#current();
        const rests = this.#dry || this.#complete || this.#fault || this.#lowered.length > 0;
        if (rests) break;
        if (decoder.waiting() >= this.#most) {
          if (this.#isFull() || !this.#contents) break;
          this.#pieces.push(this.#delta(decoder));
        }
        this.#slice(decoder);
        for (const wake of this.#wake.splice(0)) wake();
        await breath();
      }
    } catch (error) {
      this.#fault = error as Error;
    } finally {
      this.#working = false;
    }
    for (const wake of this.#wake.splice(0)) wake();
  }

  #slice(decoder: Decoder): void {
    const begin = performance.now();
    while (decoder.waiting() < this.#most && performance.now() - begin < SLICE) {
      const told = decoder.poll();
      if (told) {
        this.#any = true;
        this.#note(decoder);
        if (this.#fault || this.#complete) return;
        continue;
      }
      const next = this.#isSatisfied() ? undefined : this.#queue.shift();
      this.#dry = !next;
      if (!next) return;
      decoder.push(next.at, next.bytes);
      this.#queued -= next.bytes.byteLength;
      this.#bytes = next.at + next.bytes.byteLength;
    }
  }

  #note(decoder: Decoder): void {
    for (const report of decoder.report()) {
      const { type, ...what } = report;
      if (type === "contents") this.#contents = { ...(what as unknown as Contents), lacking: [] };
      else if (type === "attributes" && this.#contents) this.#contents = { ...this.#contents, ...(what as unknown as Pick<Contents, "fileAttributes">) };
      else if (type === "level") this.#levels.push((this.#level = what as unknown as Level));
      else if (type === "resource") this.#noteResource(decoder, (what as { number: number }).number);
      else if (type === "residue") this.#residue = what as unknown as Residue;
      else if (type === "metadata") this.#metadata = what as unknown as Metadata;
      else if (type === "wanted" && this.#contents) {
        this.#contents = { ...this.#contents, ...(what as unknown as Pick<Contents, "wanted">) };
        this.#complete = false;
      } else if (type === "end") this.#complete = true;
      else if (type === "fault") this.#fault = errorOf(what as unknown as Fault);
    }
  }

  #noteResource(decoder: Decoder, number: number): void {
    const { resources } = this.#contents!;
    const { kind } = resources[number]!;
    const [bytes, first] = [decoder.resource(number), resources.findIndex((resource) => resource.kind === kind)];
    this.#resources.push({ kind, number: number - first, bytes });
    if (kind !== "scene") return;
    try {
      this.#document = JSON.parse(new TextDecoder().decode(bytes)) as Document;
    } catch {
      // Whoever makes a scene of it will say so.
      return;
    }
    this.#skip(decoder);
    this.#note(decoder);
  }

  /** Leaves out images that are larger than wanted; what was left out and is wanted now, `Contents.lacking` tells. */
  #skip(decoder: Decoder): void {
    if (!this.#document || !this.#contents) return;
    const first = this.#contents.resources.findIndex(({ kind }) => kind === "buffer");
    const others = unwanted(this.#document, this.#settings.until?.textures ?? Infinity).map((buffer) => buffer + first);
    const fresh = others.filter((number) => !this.#skipped.has(number) && this.#contents!.resources[number]);
    for (const number of fresh) this.#skipped.add(number);
    if (fresh.length > 0) decoder.skip(fresh);
    this.#contents = { ...this.#contents, lacking: [...this.#skipped].filter((number) => !others.includes(number)) };
  }

  #delta(decoder: Decoder): Delta {
    const contents = this.#contents;
    if (!contents) throw new Error("there is no mesh before the table of contents");
    const changes = decoder.take();
    this.#count();
    const levels = this.#levels.splice(0);
    this.#any = false;
    this.#stir();
    const lowered = this.#lowered[this.#lowered.length - 1];
    return {
      vertices: changes.vertices,
      triangles: changes.triangles,
      firstVertex: changes.firstVertex,
      appended: { position: changes.positions, normal: changes.normals },
      from: changes.from,
      jump: changes.jump,
      changed: {
        position: { vertices: changes.moved, values: changes.movedPositions },
        normal: { vertices: changes.turned, values: changes.turnedNormals },
      },
      firstTriangle: changes.firstTriangle,
      indices: changes.indices,
      rewritten: { triangles: changes.rewritten, indices: changes.rewrittenIndices },
      attributes: attributesOf(contents.fileAttributes, changes),
      resources: this.#resources.splice(0),
      contents,
      level: lowered === undefined ? this.#level : (contents.levels[lowered] ?? null),
      levels,
      bytes: this.#decoded,
      residue: this.#residue,
      metadata: this.#metadata,
      complete: this.#complete,
      prefix: this.#isPrefix,
      more: false,
    };
  }

  /** Until something is different, or for so many milliseconds. */
  #stirred(most?: number): Promise<void> {
    return new Promise((resolve) => {
      const timer = most === undefined ? undefined : setTimeout(resolve, most);
      this.#wake.push(() => {
        clearTimeout(timer);
        resolve();
      });
    });
  }

  /** Something is different: whoever waits looks again, and there may be work. */
  #stir(): void {
    for (const wake of this.#wake.splice(0)) wake();
    void this.#work();
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
    ...delta.resources.map(({ bytes }) => bytes),
    ...(delta.attributes ? arraysOf(delta.attributes) : []),
  ];
  return arrays.map((array) => array.buffer as ArrayBuffer);
}

function arraysOf({ vertices, indices, values, rewritten }: Attributes): Numbers[] {
  return [vertices, indices, ...Object.values(values), rewritten.indices, ...Object.values(rewritten.values)];
}

/** Bytes that wait to be decoded before no more are read. */
const MOST_QUEUED = 4 << 20;
/** Bytes given to the decoder at a time, so that it is seen soon where what is wanted ends. */
const PIECE = 1 << 18;
/** Numbers that one delta holds at most, about, and all that have been made ahead: the page takes some milliseconds to apply them. */
const MOST_NUMBERS = 800_000;
/** Milliseconds of decoding between two looks at what else is wanted. */
const SLICE = 8;
