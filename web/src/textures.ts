// Textures by degrees: an image is its smallest preview first, then whatever finer comes, in place.

import type { Material, Texture } from "three";
import type { GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { imageOf, versionsOf, type Document, type Version } from "./document.js";
import type { UnweldScene } from "./refining.js";

export class Textures {
  readonly #document: Document;
  readonly #scene: UnweldScene;
  readonly #versions: Version[][];
  #shown: number[];
  #parser: GLTFParser | null = null;
  #begun: () => void = () => {};
  readonly #isBegun = new Promise<void>((resolve) => (this.#begun = resolve));
  /** Images that are being decoded. */
  readonly #busy = new Set<Promise<void>>();
  #isDisposed = false;

  /** Changes the document: its images are the smallest there are. */
  constructor(document: Document, scene: UnweldScene) {
    this.#document = document;
    this.#scene = scene;
    this.#versions = (document.images ?? []).map(versionsOf);
    this.#shown = this.#versions.map(() => 0);
    document.images?.forEach((image, k) => {
      const first = this.#versions[k]![0];
      if (!first) return;
      image.bufferView = first.view;
      if (first.mimeType !== undefined) image.mimeType = first.mimeType;
    });
    this.#versions.forEach((versions, image) => {
      versions.forEach((version, k) => {
        if (k > 0) void this.#await(image, k, version);
      });
    });
  }

  /** Three.js has made textures of the smallest. */
  begin(parser: GLTFParser): void {
    this.#parser = parser;
    this.#begun();
  }

  /** When all that has come is shown. */
  async settled(): Promise<void> {
    while (this.#busy.size > 0) await Promise.all(this.#busy);
  }

  dispose(): void {
    this.#isDisposed = true;
    for (const texture of this.#textures()) texture.dispose();
  }

  async #await(image: number, k: number, { view, mimeType }: Version): Promise<void> {
    const { buffer, byteOffset = 0, byteLength } = this.#document.bufferViews![view]!;
    const bytes = await this.#scene.buffer(buffer);
    const blob = new Blob([bytes.subarray(byteOffset, byteOffset + byteLength)], mimeType === undefined ? {} : { type: mimeType });
    const busy = this.#isBegun.then(() => this.#refine(image, k, blob)).catch((error: unknown) => console.error(`image ${image}`, error));
    this.#busy.add(busy);
    await busy;
    this.#busy.delete(busy);
  }

  async #refine(image: number, k: number, blob: Blob): Promise<void> {
    if (this.#shown[image]! >= k || this.#isDisposed) return;
    // Off this thread, and as GLTFLoader does it.
    const bitmap = await createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
    if (this.#shown[image]! >= k || this.#isDisposed) return bitmap.close();
    this.#shown[image] = k;
    const sources = new Set<Texture["source"]>();
    for (const [object, { textures: number }] of this.#parser!.associations as Map<object, { textures?: number }>) {
      if (number !== undefined && imageOf(this.#document, number) === image) sources.add((object as Texture).source);
    }
    const before = new Set<unknown>();
    for (const texture of this.#textures()) {
      if (!sources.has(texture.source)) continue;
      // Room on the graphics card is of the size that it was made with.
      texture.dispose();
      before.add(texture.source.data);
    }
    for (const source of sources) source.data = bitmap;
    for (const texture of this.#textures()) if (sources.has(texture.source)) texture.needsUpdate = true;
    for (const old of before) if (old instanceof ImageBitmap) old.close();
    this.#scene.dispatchEvent({ type: "texture", image, size: Math.max(bitmap.width, bitmap.height) });
  }

  /** All textures of all materials that three.js has made of the document. */
  #textures(): Set<Texture> {
    const textures = new Set<Texture>();
    for (const object of this.#parser?.associations.keys() ?? []) {
      if ((object as Partial<Texture>).isTexture) textures.add(object as unknown as Texture);
      if (!(object as Partial<Material>).isMaterial) continue;
      for (const value of Object.values(object)) if ((value as Partial<Texture> | null)?.isTexture) textures.add(value as Texture);
    }
    return textures;
  }
}
