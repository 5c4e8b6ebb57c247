import { BufferAttribute, BufferGeometry } from "three";
import type { Contents, Delta, Level, MeshStream, Until } from "./unweld.js";
/** What `UnweldGeometry` dispatches when it has changed. */
export interface RefineEvent {
    type: "refine";
    delta: Delta;
}
/** All that `UnweldGeometry` dispatches: `complete` when all that is wanted is there or a prefix has ended, `error` when it will not be. */
export interface GeometryEvents {
    refine: RefineEvent;
    complete: object;
    error: {
        error: unknown;
    };
    dispose: object;
}
/** Settings of a geometry. */
export interface GeometryOptions {
    /** Whether there are attributes for `geomorph`. */
    morph?: boolean;
    /** Whether it waits for `want`. */
    waits?: boolean;
}
/**
 * A geometry that deltas are applied to. From the level on at which attributes of the file are born, mostly the first that is there, its buffers are by
 * wedge; they are made anew only then. The arrays of attributes and index have room for more than their `count` and `drawRange` tell.
 * Bounding box and sphere are those of the whole file from the first; computed anew, they are of what has arrived.
 */
export declare class UnweldGeometry extends BufferGeometry<Record<string, BufferAttribute>, GeometryEvents> {
    #private;
    /** What the file holds, once known. */
    contents: Contents | null;
    /** Vertices and triangles of the mesh as it stands. */
    vertices: number;
    triangles: number;
    /** The finest level that has arrived, or `null` before the base has. */
    finest: number | null;
    /** Whether it has attributes of the file: then its buffers are by wedge, and its groups are the parts, once those are alive. */
    dressed: boolean;
    /** Whether these have one normal for each triangle: then it is to be drawn with `flatShading`, at coarser levels without normals, too. */
    flat: boolean;
    /** The delta applied last. */
    last: Delta | null;
    /** When vertices were appended last, on `clock`. */
    lastBorn: number;
    /**
     * The level to make room for, `null` for what is wanted. Where a coarser level is shown, what it leaves empty of the room is given up: without a
     * level here, only if that is more than half of it.
     */
    room: number | null;
    /**
     * When all that is wanted first is there, or the prefix of a file has ended (`last.prefix`). Rejected with an `AbortError` where the geometry is
     * disposed of before.
     */
    readonly complete: Promise<void>;
    /** Follows a stream. */
    constructor(stream: MeshStream, { morph, waits }?: GeometryOptions);
    /** How far the surface jumped at most with the delta applied last, new vertices being where they begin: see `Delta.jump`. */
    get jump(): number;
    /** Bytes of attributes and index. */
    get bytes(): number;
    /** Bytes that a level takes, without what residue and attributes of the file add to level 0. */
    bytesOf({ vertices, triangles }: Level): number;
    /** Seconds since loading began: what `geomorph` wants to know. */
    clock(): number;
    /** Shows a level that has arrived, or with `null` the finest; wants `UnweldLoader.levels`. */
    show(level: number | null): Promise<void>;
    /**
     * Wants more or less of the file from now on; resolves when it is there. Only bytes that are missing are fetched; what there is stays. Where
     * a coarser level is shown, that comes first: `show(null)`.
     */
    want(until: Until): Promise<void>;
    /** Goes on after a `ConnectionError`; resolves when all that is wanted is there. */
    resume(): Promise<void>;
    /** Applies what has changed; only that is sent to the graphics card. */
    apply(delta: Delta): void;
}
/** The edges of a growing geometry, for `LineSegments`: it shares the positions and follows. */
export declare class UnweldEdges extends BufferGeometry {
    #private;
    constructor(mesh: UnweldGeometry);
    dispose(): void;
}
