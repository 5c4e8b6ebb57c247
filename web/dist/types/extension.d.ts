import type { GLTF, GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { UnweldScene } from "./refining.js";
import { type DecodeOptions } from "./unweld.js";
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
export declare class UnweldExtension implements GLTFLoaderPlugin {
    #private;
    readonly name = "UNWELD_progressive_mesh";
    constructor(parser: GLTFParser, options?: ExtensionOptions);
    afterRoot(gltf: GLTF): Promise<void>;
}
