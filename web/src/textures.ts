// Textures by degrees: an image is its smallest preview first, then whatever finer comes, in place.

import type { Material, Texture } from "three";
import type { GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { bitmapOf } from "./plugin.js";
import { imageOf, lateViews, versionsOf, type Document, type Version } from "./document.js";
import type { Contents } from "./unweld.js";
import type { UnweldScene } from "./refining.js";

export class Textures {
  readonly #document: Document;
  readonly #scene: UnweldScene;
  readonly #versions: Version[][];
  #shown: number[];
  /** Of each image the finest version that has come. */
  readonly #come: number[];
  #parser: GLTFParser | null = null;
  #begun: () => void = () => {};
  readonly #isBegun = new Promise<void>((resolve) => (this.#begun = resolve));
  #isDisposed = false;

  /** Changes the document: its images are the smallest there are, or for those that come late without a preview a single pixel. */
  constructor(document: Document, scene: UnweldScene, contents: Contents) {
    this.#document = document;
    this.#scene = scene;
    const late = lateViews(document, contents);
    this.#versions = (document.images ?? []).map((image, k) => {
      const versions = versionsOf(image);
      const [first] = versions;
      if (!first || !late.has(first.view) || first.mimeType === "image/ktx2") return versions;
      return [{ size: 1, view: scene.provide(document, pixel(colourOf(document, k))), mimeType: "image/bmp" }, ...versions];
    });
    this.#shown = this.#versions.map(() => 0);
    this.#come = this.#versions.map(() => 0);
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

  dispose(): void {
    this.#isDisposed = true;
    for (const texture of this.#textures()) texture.dispose();
  }

  async #await(image: number, k: number, { view, mimeType }: Version): Promise<void> {
    const { buffer, byteOffset = 0, byteLength } = this.#document.bufferViews![view]!;
    const bytes = await this.#scene.buffer(buffer);
    this.#come[image] = Math.max(this.#come[image]!, k);
    const blob = new Blob([bytes.subarray(byteOffset, byteOffset + byteLength)], mimeType === undefined ? {} : { type: mimeType });
    this.#scene.busy(this.#isBegun.then(() => this.#refine(image, k, blob)).catch((error: unknown) => console.error(`image ${image}`, error)));
  }

  async #refine(image: number, k: number, blob: Blob): Promise<void> {
    // A preview that has waited until the image was there is not decoded.
    if (this.#come[image]! > k || this.#isDisposed) return;
    const bitmap = await bitmapOf(blob);
    if (this.#shown[image]! >= k || this.#isDisposed) return bitmap.close();
    this.#shown[image] = k;
    const sources = new Set<Texture["source"]>();
    for (const [object, made] of this.#parser!.associations as Map<object, { textures?: number } | undefined>) {
      const number = made?.textures;
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

/** What changes least where an image is missing: no light of its own, no bumps, else white. */
function colourOf(document: Document, image: number): readonly [number, number, number] {
  const is = (texture?: { index: number }) => texture !== undefined && imageOf(document, texture.index) === image;
  if (document.materials?.some(({ normalTexture }) => is(normalTexture))) return [128, 128, 255];
  return document.materials?.some(({ emissiveTexture }) => is(emissiveTexture)) ? [0, 0, 0] : [255, 255, 255];
}

/** A picture of one pixel, as BMP. */
function pixel([red, green, blue]: readonly [number, number, number]): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(58);
  const view = new DataView(bytes.buffer);
  bytes.set([0x42, 0x4d, 58]);
  bytes.set([54, 0, 0, 0, 40], 10);
  view.setUint32(18, 1, true);
  view.setUint32(22, 1, true);
  view.setUint16(26, 1, true);
  view.setUint16(28, 24, true);
  bytes.set([blue, green, red], 54);
  return bytes;
}
