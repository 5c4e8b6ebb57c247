/** For three.js: glTF scenes that refine in place while they arrive, geometries and textures, and the glTF extension `UNWELD_progressive_mesh`. */
import { type LoadingManager } from "three";
import { GLTFLoader, type GLTF } from "three/addons/loaders/GLTFLoader.js";
import { StreamLoader } from "./loader.js";
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
export declare class UnweldGLTFLoader extends StreamLoader<UnweldGLTF> {
    #private;
    /** The loader that makes all but geometries: for `register`, `setKTX2Loader` and the like. */
    readonly gltf: GLTFLoader;
    /** Called whenever a scene has changed, so that a picture can be drawn that is drawn only when it is asked for. */
    onChange: (scene: UnweldScene) => void;
    constructor(manager?: LoadingManager);
    load(url: string, onLoad: (gltf: UnweldGLTF) => void, onProgress?: (event: ProgressEvent) => void, onError?: (error: unknown) => void): void;
    /** The scene of a stream, which is to have `resources`, and `jumps` where it is to have geomorphs. `path`: what addresses in it are relative to. */
    follow(stream: MeshStream, path: string, onProgress?: (event: ProgressEvent) => void): Promise<UnweldGLTF>;
}
