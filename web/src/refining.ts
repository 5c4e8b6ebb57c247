// A scene on its way: its stream, its geometries, its binary data, its textures.

import { Box3, EventDispatcher, type Material, type Mesh, Sphere } from "three";
import type { GLTF } from "three/addons/loaders/GLTFLoader.js";
import { PartGeometry } from "./buffers.js";
import { partsOf, type Document } from "./document.js";
import { Following } from "./following.js";
import { geomorph, type Slide } from "./geomorph.js";
import { Layout } from "./layout.js";
import { Textures } from "./textures.js";
import type { Contents, Delta, Level, MeshStream, Until } from "./unweld.js";

/** What `UnweldScene` dispatches. */
export interface SceneEvents {
  /** Geometries have changed. */
  refine: { delta: Delta };
  /** An image has become finer: its number in the document, and pixels along its longer side. */
  texture: { image: number; size: number };
  /** The samples of an animation have come, after the first picture: its number in the document. */
  animation: { animation: number };
  /** All that is wanted is there, or a prefix has ended. */
  complete: object;
  /** It will not be. */
  error: { error: unknown };
}

/** How a scene refines: `gltf.unweld`. */
export class UnweldScene extends EventDispatcher<SceneEvents> {
  /** What the file holds, once known. */
  contents: Contents | null = null;
  /** Triangles of the mesh as it stands: each part once, however often it is shown. */
  triangles = 0;
  /** The finest level that has arrived, or `null` before the base has. */
  finest: number | null = null;
  /** The delta applied last. */
  last: Delta | null = null;
  /** When vertices were appended last, on `clock`. */
  lastBorn = -Infinity;
  /** What a planner says of the level to come. */
  room: number | null = null;
  /** Of the whole scene as it stood when it was loaded, in the space of `gltf.scene`. */
  boundingSphere: Sphere | null = null;
  /** Uniforms of all its materials, where it is loaded with `morph`. */
  readonly slide: Slide = { time: { value: 0 }, seconds: { value: 0.35 } };
  /** When all that is wanted first is there and shown, textures and animations too, or the prefix of a file has ended (`last.prefix`). */
  readonly complete: Promise<void>;
  /** @internal The document, as soon as there are geometries for it. */
  readonly ready: Promise<Document>;
  readonly #following: Following;
  readonly #morph: boolean;
  readonly #relative: boolean;
  readonly #begin = performance.now();
  readonly #buffers = new Map<number, Awaited>();
  readonly #busy = new Set<Promise<void>>();
  #document: Document | null;
  #layout: Layout | null = null;
  #textures: Textures | null = null;
  /** What has come before the document. */
  #waiting: Delta[] = [];
  #isReady: (document: Document) => void = () => {};
  /** Applied, but not told: more is there already, and one picture shows all of it. */
  #untold: Delta[] = [];

  /** Follows a stream. `document`: where the file does not hold one. */
  constructor(stream: MeshStream, { morph = false, document = null }: { morph?: boolean; document?: Document | null }) {
    super();
    this.#morph = morph;
    this.#relative = stream.relative;
    this.#document = document;
    const ready = new Promise<Document>((resolve) => (this.#isReady = resolve));
    let ended: (error?: { readonly error: unknown }) => void = () => {};
    this.#following = new Following(stream, { apply: (delta) => this.#take(delta), ended: (error) => ended(error) }, { draws: true });
    this.complete = this.#following.complete.then(() => this.#settled());
    this.complete.catch(() => {});
    ended = (error) => {
      this.#tell();
      if (error) this.dispatchEvent({ type: "error", ...error });
      else void this.#settled().then(() => this.dispatchEvent({ type: "complete" }));
    };
    const none = () => new Error("the file holds no scene: UnweldLoader loads it");
    this.ready = Promise.race([ready, this.#following.complete.then(() => (this.#layout ? ready : Promise.reject(none())))]);
    this.ready.catch(() => {});
  }

  /** How far the surface jumped at most with the delta applied last, new vertices being where they begin. */
  get jump(): number {
    return this.last?.jump ?? 0;
  }

  /** Bytes of all vertex and index buffers. */
  get bytes(): number {
    return this.#layout?.bytes ?? 0;
  }

  /** Bytes that a level takes, about: those of now, by its triangles. */
  bytesOf({ vertices, triangles }: Level): number {
    return this.triangles > 0 ? (this.bytes * triangles) / this.triangles : 24 * vertices + 12 * triangles;
  }

  /** Seconds since loading began. */
  clock(): number {
    return (performance.now() - this.#begin) / 1000;
  }

  /** Shows a level that has arrived, or with `null` the finest; wants `UnweldGLTFLoader.levels`. */
  show(level: number | null): Promise<void> {
    return this.#following.show(level);
  }

  /** Wants more or less of the file from now on; resolves when it is there. Only bytes that are missing are fetched. */
  async want(until: Until): Promise<void> {
    await this.#following.want(until);
    await this.#settled();
  }

  /** Goes on after a `ConnectionError`; resolves when all that is wanted is there. */
  resume(): Promise<void> {
    return this.#following.resume();
  }

  /** Ends the stream and frees geometries and textures. */
  dispose(): void {
    this.#following.dispose();
    this.#layout?.dispose();
    this.#textures?.dispose();
  }

  /** @internal The geometry of a part. */
  geometry(part: number): PartGeometry | undefined {
    return this.#layout?.geometries.get(part);
  }

  /** @internal The geometries, for a document that is known before anything has come. */
  prepare(document: Document): Layout {
    return (this.#layout ??= new Layout(partsOf(document), { morph: this.#morph, relative: this.#relative }));
  }

  /** @internal Binary data by the number of the buffer, as soon as they are there. */
  buffer(number: number): Promise<Uint8Array<ArrayBuffer>> {
    return this.#awaited(number).promise;
  }

  /** @internal What has come, but is not shown yet; errors of it are told. */
  busy(work: Promise<void>): void {
    const busy = work.catch((error: unknown) => console.error(error)).then(() => void this.#busy.delete(busy));
    this.#busy.add(busy);
  }

  /** @internal Binary data, but an error where all that is wanted has come without them. */
  arriving(number: number): Promise<Uint8Array<ArrayBuffer>> {
    const over = this.#following.complete.then(() => Promise.reject(new Error(`buffer ${number} is not wanted`)));
    return Promise.race([this.buffer(number), over]);
  }

  /** @internal Adds binary data to a document; the number of their view. */
  provide(document: Document, bytes: Uint8Array<ArrayBuffer>): number {
    const views = (document.bufferViews ??= []);
    const buffer = OWN + views.length;
    this.#awaited(buffer).resolve(bytes);
    return views.push({ buffer, byteLength: bytes.byteLength }) - 1;
  }

  /** @internal Three.js has made its objects. */
  assembled(gltf: GLTF): void {
    const materials = new Set<Material>();
    const box = new Box3();
    for (const scene of gltf.scenes) {
      scene.updateMatrixWorld(true);
      scene.traverse((object) => {
        const { geometry, material } = object as Partial<Mesh>;
        if (geometry instanceof PartGeometry === false) return;
        for (const one of [material ?? []].flat()) materials.add(one);
        if (geometry.boundingBox) box.union(geometry.boundingBox.clone().applyMatrix4(object.matrixWorld));
      });
    }
    if (this.#morph) for (const material of materials) geomorph(material, this.slide);
    this.boundingSphere = box.getBoundingSphere(new Sphere());
    this.#textures?.begin(gltf.parser);
  }

  /** When all that has come is shown. */
  async #settled(): Promise<void> {
    while (this.#busy.size > 0) await Promise.all(this.#busy);
  }

  #take(delta: Delta): void {
    for (const { kind, number, bytes } of delta.resources) {
      if (kind === "buffer") this.#awaited(number).resolve(bytes);
      else {
        this.#document = JSON.parse(new TextDecoder().decode(bytes)) as Document;
        this.#textures = new Textures(this.#document, this, delta.contents);
      }
    }
    this.#waiting.push(delta);
    if (!this.#document) return;
    const layout = this.prepare(this.#document);
    for (const waiting of this.#waiting.splice(0)) this.#apply(waiting, layout);
    if (this.last?.level) this.#isReady(this.#document);
  }

  #apply(delta: Delta, layout: Layout): void {
    const start = performance.now();
    this.contents = delta.contents;
    this.last = delta;
    this.triangles = delta.triangles;
    for (const { level } of delta.levels) this.finest = level;
    if (delta.firstVertex > 0 && delta.vertices > delta.firstVertex) this.lastBorn = this.clock();
    layout.apply(delta, this.clock());
    // For the developer tools.
    performance.measure("unweld", { start });
    this.#untold.push(delta);
    if (!delta.more || this.#untold.length >= MOST_UNTOLD) this.#tell();
  }

  #tell(): void {
    for (const delta of this.#untold.splice(0)) this.dispatchEvent({ type: "refine", delta });
  }

  #awaited(number: number): Awaited {
    let awaited = this.#buffers.get(number);
    if (!awaited) {
      let resolve: Awaited["resolve"] = () => {};
      const promise = new Promise<Uint8Array<ArrayBuffer>>((given) => (resolve = given));
      this.#buffers.set(number, (awaited = { promise, resolve }));
    }
    return awaited;
  }
}

/** Numbers of buffers that no file has: there are at most 2^16 resources. */
const OWN = 1 << 20;

/** Deltas that are told together at most. */
const MOST_UNTOLD = 8;

/** Binary data that may be on their way. */
interface Awaited {
  readonly promise: Promise<Uint8Array<ArrayBuffer>>;
  readonly resolve: (bytes: Uint8Array<ArrayBuffer>) => void;
}
