import type { GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { type Document } from "./document.js";
import type { UnweldScene } from "./refining.js";
export declare class Textures {
    #private;
    /** Changes the document: its images are the smallest there are. */
    constructor(document: Document, scene: UnweldScene);
    /** Three.js has made textures of the smallest. */
    begin(parser: GLTFParser): void;
    /** When all that has come is shown. */
    settled(): Promise<void>;
    dispose(): void;
}
