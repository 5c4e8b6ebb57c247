// The extension in ordinary glTF: geometries that refine from a .uwm, beside accessors that every viewer shows.

import { LoaderUtils } from "three";
import type { GLTF, GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { NAME, type Document } from "./document.js";
import { SCENE_MOST } from "./loader.js";
import { giveGeometries } from "./plugin.js";
import { UnweldScene } from "./refining.js";
import { decode, type DecodeOptions } from "./unweld.js";

export interface ExtensionOptions extends Pick<DecodeOptions, "until" | "keep" | "levels" | "pool" | "wasm" | "retries" | "signal" | "fetch"> {
  /** Whether new vertices slide to their places: `gltf.unweld.slide`. */
  morph?: boolean;
  /** Called whenever the scene has changed. */
  onChange?: (scene: UnweldScene) => void;
}

/**
 * For `GLTFLoader`: `loader.register((parser) => new UnweldExtension(parser))`. Files without the extension load as ever. Those with it show their
 * accessors at once, and refine in place; `gltf.unweld` tells how far it is.
 */
export class UnweldExtension implements GLTFLoaderPlugin {
  readonly name = NAME;
  readonly #parser: GLTFParser;
  readonly #options: ExtensionOptions;
  #scene: UnweldScene | null = null;

  constructor(parser: GLTFParser, options: ExtensionOptions = {}) {
    this.#parser = parser;
    this.#options = options;
    const document = parser.json as Document;
    if (!document.extensions?.[NAME]) return;
    giveGeometries(parser, async ({ extensions }, plain) => {
      const geometry = this.#begin(document).geometry(extensions![NAME]!.part);
      const base = await plain();
      return geometry?.begin(base) ?? base;
    });
  }

  /** The stream begins when the first geometry is asked for. */
  #begin(document: Document): UnweldScene {
    if (this.#scene) return this.#scene;
    const { morph = false, onChange, ...options } = this.#options;
    const { bufferView, uri } = document.extensions![NAME]!;
    const { path, requestHeader, withCredentials } = this.#parser.options as { path: string; requestHeader: HeadersInit; withCredentials: boolean };
    const bytes = async function* (view: Promise<ArrayBuffer>) {
      yield new Uint8Array(await view);
    };
    const input = uri === undefined ? bytes(this.#parser.getDependency("bufferView", bufferView!) as Promise<ArrayBuffer>) : LoaderUtils.resolveURL(uri, path);
    const request: RequestInit = { headers: requestHeader, credentials: withCredentials ? "include" : "same-origin" };
    const stream = decode(input, { ...options, jumps: morph, ownNormals: true, most: SCENE_MOST, request });
    const scene = new UnweldScene(stream, { morph, document });
    scene.prepare(document);
    if (onChange) scene.addEventListener("refine", () => onChange(scene));
    return (this.#scene = scene);
  }

  async afterRoot(gltf: GLTF): Promise<void> {
    if (!this.#scene) return;
    this.#scene.assembled(gltf);
    Object.assign(gltf, { unweld: this.#scene });
  }
}
