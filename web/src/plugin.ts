// What GLTFLoader asks instead of the file: geometries of parts, binary data, images by degrees.

import { Texture, type AnimationClip, type BufferGeometry, type Loader } from "three";
import type { GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { Turns } from "./breath.js";
import { NAME, type Document, type Image, type Primitive } from "./document.js";
import { Motion } from "./motion.js";
import type { UnweldScene } from "./refining.js";

type Parser = GLTFParser & {
  loadGeometries(primitives: Primitive[]): Promise<BufferGeometry[]>;
  loadImageSource(image: number, loader: Loader): Promise<Texture>;
};

/** Gives geometries for primitives that the extension describes; `own` makes one. */
export function giveGeometries(parser: GLTFParser, own: (primitive: Primitive, plain: () => Promise<BufferGeometry>) => Promise<BufferGeometry>): void {
  const their = parser as Parser;
  const load = their.loadGeometries.bind(their);
  their.loadGeometries = (primitives) =>
    Promise.all(
      primitives.map((primitive) => {
        const plain = async () => (await load([primitive]))[0]!;
        return primitive.extensions?.[NAME] ? own(primitive, plain) : plain();
      }),
    );
}

/** Gives images that stand in binary data without the detour of an address and a request for it, which may wait behind all others. */
function giveImages(parser: GLTFParser, document: Document): void {
  const their = parser as Parser;
  const load = their.loadImageSource.bind(their);
  const made = new Map<number, Promise<Texture>>();
  their.loadImageSource = (number, loader) => {
    const image = document.images?.[number];
    if (image?.bufferView === undefined || "isKTX2Loader" in loader) return load(number, loader);
    const texture = made.get(number);
    if (texture) return texture.then((texture) => texture.clone());
    const fresh = parser.getDependency("bufferView", image.bufferView).then((bytes: ArrayBuffer) => textureOf(image, bytes));
    // Three.js goes on without it.
    fresh.catch((error: unknown) => console.error(`image ${number}`, error));
    made.set(number, fresh);
    return fresh;
  };
}

async function textureOf({ mimeType, extras }: Image, bytes: ArrayBuffer): Promise<Texture> {
  const texture = new Texture(await bitmapOf(new Blob([bytes], mimeType === undefined ? {} : { type: mimeType })));
  texture.needsUpdate = true;
  if (typeof extras === "object") Object.assign(texture.userData, extras);
  texture.userData.mimeType = mimeType;
  return texture;
}

/** An image decoded off this thread, and as GLTFLoader does it. */
export function bitmapOf(blob: Blob): Promise<ImageBitmap> {
  return createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
}

/** The plugin for a scene that streams. */
export class ScenePlugin implements GLTFLoaderPlugin {
  readonly name = NAME;
  readonly #scene: UnweldScene;
  readonly #document: Document;
  readonly #motion: Motion;

  constructor(parser: GLTFParser, scene: UnweldScene) {
    this.#scene = scene;
    this.#document = parser.json as Document;
    this.#motion = new Motion(parser, this.#document, scene);
    giveImages(parser, this.#document);
    const turns = new Turns();
    giveGeometries(parser, async ({ extensions }) => {
      await turns.next();
      const geometry = scene.geometry(extensions![NAME]!.part);
      if (!geometry) throw new Error(`${NAME}: there is no part ${extensions![NAME]!.part}`);
      return geometry;
    });
  }

  loadAnimation(index: number): Promise<AnimationClip> | null {
    return this.#motion.load(index);
  }

  async loadBufferView(index: number): Promise<ArrayBuffer> {
    const { buffer, byteOffset = 0, byteLength } = this.#document.bufferViews![index]!;
    const bytes = await this.#scene.arriving(buffer);
    return bytes.slice(byteOffset, byteOffset + byteLength).buffer;
  }
}
