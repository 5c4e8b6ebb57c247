import type { Numbers } from "./unweld.js";
/** Indices of one part. */
export interface Group {
    readonly part: number;
    readonly start: number;
    readonly count: number;
}
/** Triangles by number and their parts, where an index has them part by part. */
export declare class Parts {
    #private;
    triangles: Uint32Array<ArrayBuffer>;
    /** Triangles from `first` on, where they end, are these, and of these parts. */
    append(first: number, indices: ArrayLike<number>, parts: Numbers): void;
    /** Single triangles have others. */
    rewrite(triangles: Uint32Array, indices: Uint32Array, parts: Numbers): void;
    /** Writes the first triangles, which are all, part by part, in ascending order, each part's in the order in which they are. */
    sort(count: number, into: {
        [at: number]: number;
    }): Group[];
}
