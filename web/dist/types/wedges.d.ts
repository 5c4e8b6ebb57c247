/** Wedges by vertex. They are appended; each stays with its vertex. */
export declare class Wedges {
    #private;
    count: number;
    /** Those for which the file has no normal. */
    readonly bare: Set<number>;
    append(vertices: Uint32Array): void;
    /** A wedge of a vertex, or -1. */
    any(v: number): number;
    /** The wedge of the same vertex that came before, or -1. */
    previous(wedge: number): number;
    vertex(wedge: number): number;
    /** All wedges of some vertices, and for each the place of its vertex among them; `only` some of the wedges. */
    of(vertices: Uint32Array, only?: ReadonlySet<number>): {
        wedges: Uint32Array;
        places: Uint32Array;
    };
}
/** Whether the three corners of every triangle have the same normal. Equal normals of a source stay equal, however few bits they have. */
export declare function isFlat(normals: ArrayLike<number>, indices: ArrayLike<number>, triangles: number): boolean;
/** The same numbers, with room for so many: twice as much as before where it does not suffice. */
export declare function grown(array: Uint32Array<ArrayBuffer>, length: number): Uint32Array<ArrayBuffer>;
