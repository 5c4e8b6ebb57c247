// What GLTFLoader asks instead of the file: geometries of parts, binary data, images by degrees.

import type { BufferGeometry } from "three";
import type { GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { NAME, type Document, type Primitive } from "./document.js";
import type { UnweldScene } from "./refining.js";

type Parser = GLTFParser & { loadGeometries(primitives: Primitive[]): Promise<BufferGeometry[]> };

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

/** The plugin for a scene that streams. */
export class ScenePlugin implements GLTFLoaderPlugin {
  readonly name = NAME;
  readonly #scene: UnweldScene;
  readonly #document: Document;

  constructor(parser: GLTFParser, scene: UnweldScene) {
    this.#scene = scene;
    this.#document = parser.json as Document;
    giveGeometries(parser, async ({ extensions }) => {
      const geometry = scene.geometry(extensions![NAME]!.part);
      if (!geometry) throw new Error(`${NAME}: there is no part ${extensions![NAME]!.part}`);
      return geometry;
    });
  }

  async loadBufferView(index: number): Promise<ArrayBuffer> {
    const { buffer, byteOffset = 0, byteLength } = this.#document.bufferViews![index]!;
    const bytes = await this.#scene.arriving(buffer);
    return bytes.slice(byteOffset, byteOffset + byteLength).buffer;
  }
}
