import { type AnimationClip, type BufferGeometry } from "three";
import type { GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { type Primitive } from "./document.js";
import type { UnweldScene } from "./refining.js";
/** Gives geometries for primitives that the extension describes; `own` makes one. */
export declare function giveGeometries(parser: GLTFParser, own: (primitive: Primitive, plain: () => Promise<BufferGeometry>) => Promise<BufferGeometry>): void;
/** An image decoded off this thread, and as GLTFLoader does it. */
export declare function bitmapOf(blob: Blob): Promise<ImageBitmap>;
/** The plugin for a scene that streams. */
export declare class ScenePlugin implements GLTFLoaderPlugin {
    #private;
    readonly name = "UNWELD_progressive_mesh";
    constructor(parser: GLTFParser, scene: UnweldScene);
    loadAnimation(index: number): Promise<AnimationClip> | null;
    loadBufferView(index: number): Promise<ArrayBuffer>;
}
