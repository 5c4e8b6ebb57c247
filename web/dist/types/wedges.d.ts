import type { Numbers } from "./unweld.js";
/** Wedges by vertex. They are appended; each stays with its vertex. */
export declare class Wedges {
    #private;
    count: number;
    /** Those for which the file has no normal. */
    readonly bare: Set<number>;
    append(vertices: Uint32Array): void;
    /** A wedge of a vertex, or -1. */
    any(v: number): number;
    vertex(wedge: number): number;
    /** All wedges of some vertices, and for each the place of its vertex among them; `only` some of the wedges. */
    of(vertices: Uint32Array, only?: ReadonlySet<number>): {
        wedges: Uint32Array;
        places: Uint32Array;
    };
}
/** Whether the three corners of every triangle have the same normal. Equal normals of a source stay equal, however few bits they have. */
export declare function isFlat(normals: ArrayLike<number>, indices: ArrayLike<number>, triangles: number): boolean;
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
    /** Triangles from `first` on are these, and of these parts. */
    append(first: number, indices: ArrayLike<number>, parts: Numbers): void;
    /** Single triangles have others. */
    rewrite(triangles: Uint32Array, indices: Uint32Array, parts: Numbers): void;
    /** Writes the first triangles part by part, in ascending order, each part's in the order in which they are. */
    sort(count: number, into: {
        [at: number]: number;
    }): Group[];
}
