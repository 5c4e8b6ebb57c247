/** For three.js: glTF scenes that refine in place while they arrive, geometries and textures, and the glTF extension `UNWELD_progressive_mesh`. */

import { LoaderUtils, type LoadingManager } from "three";
import { GLTFLoader, type GLTF, type GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { breath } from "./breath.js";
import { StreamLoader } from "./loader.js";
import { NAME, type Document } from "./document.js";
import { ScenePlugin } from "./plugin.js";
import { UnweldScene } from "./refining.js";
import type { MeshStream } from "./unweld.js";

export { PartGeometry } from "./buffers.js";
export { UnweldExtension, type ExtensionOptions } from "./extension.js";
export { UnweldScene } from "./refining.js";

/** What `GLTFLoader` gives, and how its refinement goes on. */
export interface UnweldGLTF extends GLTF {
  readonly unweld: UnweldScene;
}

/**
 * Loads scenes: `.uwm` files made of glTF. Resolves with what `GLTFLoader` gives as soon as there is something to show, after the first kilobytes;
 * geometries and textures go on refining in place. `gltf.unweld.complete` is a promise of the end.
 *
 * ```js
 * const gltf = await new UnweldGLTFLoader().loadAsync("helmet.uwm");
 * scene.add(gltf.scene);
 * ```
 */
export class UnweldGLTFLoader extends StreamLoader<UnweldGLTF> {
  /** The loader that makes all but geometries: for `register`, `setKTX2Loader` and the like. */
  readonly gltf: GLTFLoader;
  /** Called whenever a scene has changed, so that a picture can be drawn that is drawn only when it is asked for. */
  onChange: (scene: UnweldScene) => void = () => {};
  readonly #scenes = new WeakMap<object, UnweldScene>();

  constructor(manager?: LoadingManager) {
    super(manager);
    this.gltf = new GLTFLoader(this.manager);
    this.gltf.register((parser: GLTFParser) => {
      const scene = this.#scenes.get(parser.json as object);
      return scene ? new ScenePlugin(parser, scene) : { name: NAME };
    });
  }

  override load(url: string, onLoad: (gltf: UnweldGLTF) => void, onProgress?: (event: ProgressEvent) => void, onError?: (error: unknown) => void): void {
    const path = this.resolve(url);
    this.manager.itemStart(path);
    this.follow(this.stream(path, { resources: true }), path, onProgress).then(
      (gltf) => {
        onLoad(gltf);
        this.manager.itemEnd(path);
      },
      (error: unknown) => {
        (onError ?? console.error)(error);
        this.manager.itemError(path);
        this.manager.itemEnd(path);
      },
    );
  }

  /** The scene of a stream, which is to have `resources`, and `jumps` where it is to have geomorphs. `path`: what addresses in it are relative to. */
  follow(stream: MeshStream, path: string, onProgress?: (event: ProgressEvent) => void): Promise<UnweldGLTF> {
    const scene = new UnweldScene(stream, { morph: this.morph });
    scene.addEventListener("refine", ({ delta }) => {
      onProgress?.(new ProgressEvent("progress", { lengthComputable: true, loaded: delta.bytes, total: delta.contents.wanted.end }));
      this.onChange(scene);
    });
    scene.addEventListener("texture", () => this.onChange(scene));
    return this.#assemble(scene, path);
  }

  /** What `GLTFLoader` makes of the document; it gets geometries and binary data from the scene. */
  async #assemble(scene: UnweldScene, path: string): Promise<UnweldGLTF> {
    const document: Document = await scene.ready;
    // The base has just been applied, in the same task.
    await breath();
    this.#scenes.set(document, scene);
    try {
      const parsed = this.gltf.parseAsync(document as unknown as string, LoaderUtils.extractUrlBase(path));
      // A stream that breaks before its first picture is an error; later it is an event.
      const gltf = await Promise.race([parsed, scene.complete.then(() => parsed)]);
      scene.assembled(gltf);
      return Object.assign(gltf, { unweld: scene });
    } catch (error) {
      scene.dispose();
      throw error;
    }
  }
}
