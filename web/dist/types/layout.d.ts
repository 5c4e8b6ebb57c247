import { PartGeometry, type PartOf } from "./buffers.js";
import type { Delta } from "./unweld.js";
/**
 * All parts of a scene. Vertex buffers are shared by the parts that have the same attributes; those with a skin or morph targets have their own. An
 * index is the part's. The mesh of the file has its positions times 2^k, k a number of each part: the geometries have them as the scene means them.
 */
export declare class Layout {
    #private;
    /** By number of the part; parts that no primitive shows have none. */
    readonly geometries: Map<number, PartGeometry>;
    /** Bytes of all buffers. */
    get bytes(): number;
    constructor(parts: readonly PartOf["spec"][], { morph, relative }: {
        morph: boolean;
        relative: boolean;
    });
    /** Applies what has changed; `time` is when new vertices are born. */
    apply(moved: Delta, time: number): void;
    /** Ends all buffers. */
    dispose(): void;
}
