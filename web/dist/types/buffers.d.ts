import { BufferAttribute, BufferGeometry, Vector3 } from "three";
import type { FileAttribute, Numbers } from "./types.js";
/** How glTF describes an accessor. */
export interface Kind {
    readonly componentType: number;
    readonly type: string;
    readonly normalized?: boolean;
}
/** A part as a primitive tells it. */
export interface PartSpec {
    readonly part: number;
    readonly exponent: number;
    readonly attributes: Readonly<Record<string, Kind>>;
    readonly targets: readonly Readonly<Record<string, Kind>>[];
    /** Whether its buffers are its own. */
    readonly alone: boolean;
}
/** A part and its triangles: how many, which, and the places that have changed. */
export interface PartOf {
    readonly spec: PartSpec;
    readonly buffers: Buffers;
    readonly geometry: PartGeometry;
    count: number;
    triangles: Uint32Array<ArrayBuffer>;
    changed: number[];
}
/** What is new of vertices and wedges. */
export interface Fresh {
    readonly firstVertex: number;
    readonly position: Float32Array;
    readonly normal: Float32Array;
    readonly from: Float32Array;
    /** When the vertices were born; `null`: at `time`, all of them. */
    readonly born: Float32Array | null;
    readonly time: number;
    readonly firstWedge: number;
    /** The vertices of the wedges. */
    readonly vertices: Uint32Array;
    readonly values: Readonly<Record<string, Numbers>>;
}
/** Where wedges are. */
interface Places {
    vertex(wedge: number): number;
    scale(vertex: number): number;
    sibling(vertex: number, isThere: (buffers: Buffers, slot: number) => boolean): [Buffers, number] | null;
    home(wedge: number): [Buffers, number];
}
/** Vertices of parts that have the same attributes. */
export declare class Buffers {
    #private;
    readonly geometries: PartGeometry[];
    readonly number: number;
    count: number;
    constructor(number: number, { attributes, targets }: PartSpec, morph: boolean);
    arrays(into: Set<ArrayBufferView>): Set<ArrayBufferView>;
    /** Before a delta: what the file has of the attributes that are alive; `null` where nothing is said of them. */
    begin(file: readonly FileAttribute[], alive: readonly string[] | null, anew: boolean): void;
    /** A place for a wedge. */
    add(wedge: number): number;
    wedge(slot: number): number;
    read(name: string, slot: number, into: Float32Array, item: number, scale: number): void;
    /** A vertex that was there has another position or normal. */
    move(name: "position" | "normal", slot: number, values: Float32Array, place: number, scale: number): void;
    /** Values of the wedges added. `share`: how many times as many there may be. */
    fill(fresh: Fresh, share: number, places: Places): void;
    /** After a delta: what is to be sent. */
    end(): void;
    /** The largest displacement of a morph target at a vertex, along each axis, added to `into`. */
    displacement(slot: number, into: Vector3): void;
    position(slot: number, into: Vector3): Vector3;
}
/**
 * The geometry of a part: an index of its own into buffers that it may share with others. Bounding box and sphere are of what has arrived, and of what may
 * still come.
 */
export declare class PartGeometry extends BufferGeometry<Record<string, BufferAttribute>, {
    dispose: object;
}> {
    #private;
    /** Shows another geometry until there is something of its own. */
    begin(plain: BufferGeometry): this;
    /** Its triangles, not all vertices of the buffers. */
    computeBoundingBox(): void;
    computeBoundingSphere(): void;
    /** The index, with room for so many triangles. */
    room(triangles: number, share: number): {
        [at: number]: number;
    };
    reach(buffers: Buffers, slot: number): void;
    /**
     * After a delta. Coarser levels are forgotten, whose vertices may have lain further out, where all is there and, lest every triangle be looked at with
     * every level, where there are twice as many as then.
     */
    end(part: PartOf, error: number, { anew, level, last }: {
        anew: boolean;
        level: boolean;
        last: boolean;
    }): void;
    /** The renderer has put morph targets into a texture, which it makes anew only for a geometry that is new to it. */
    renewTargets(): void;
}
export {};
