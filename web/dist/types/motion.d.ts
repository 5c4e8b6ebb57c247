import { type AnimationClip } from "three";
import type { GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { type Document } from "./document.js";
import type { UnweldScene } from "./refining.js";
export declare class Motion {
    #private;
    constructor(parser: GLTFParser, document: Document, scene: UnweldScene);
    /** A clip that stands still until its samples have come; `null` where it need not wait for them. */
    load(animation: number): Promise<AnimationClip> | null;
}
