import type { GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { type Document } from "./document.js";
import type { Contents } from "./unweld.js";
import type { UnweldScene } from "./refining.js";
export declare class Textures {
    #private;
    /** Changes the document: its images are the smallest there are, or for those that come late without a preview a single pixel. */
    constructor(document: Document, scene: UnweldScene, contents: Contents);
    /** Three.js has made textures of the smallest. */
    begin(parser: GLTFParser): void;
    dispose(): void;
}
