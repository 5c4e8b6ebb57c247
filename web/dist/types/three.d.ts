/** A loader for three.js: a geometry that grows in place while its file arrives. */
import { BufferAttribute, BufferGeometry, Loader, type LoadingManager, type Material } from "three";
import { type Contents, type Delta, type MeshStream, type Until } from "./unweld.js";
/** What `UnweldGeometry` dispatches. */
export interface RefineEvent {
    type: "refine";
    delta: Delta;
}
/**
 * Loads `.uwm` files. `onLoad` gets the geometry as soon as it shows something, after the first kilobytes; it is refined in place until the
 * file is complete, and dispatches `refine` each time. `geometry.complete` is a promise of that.
 *
 * ```js
 * const geometry = await new UnweldLoader().loadAsync("bunny.uwm");
 * scene.add(new Mesh(geometry, new MeshStandardMaterial()));
 * ```
 */
export declare class UnweldLoader extends Loader<UnweldGeometry> {
    #private;
    /** How far to decode. */
    until: Until;
    /** Positions relative to the smallest corner of the bounding box, which is `geometry.contents.min`. */
    relative: boolean;
    /** Whether `geometry.show` will be used. */
    levels: boolean;
    /** Whether new vertices slide to their places: for materials that `geomorph` has changed. */
    morph: boolean;
    /** How often in a row a lost connection is tried again. */
    retries: number;
    /** Where `worker.js` and `unweld.wasm` are, if not beside the script. */
    workerUrl: string | URL | undefined;
    wasmUrl: string | URL | undefined;
    constructor(manager?: LoadingManager);
    /** Most workers. */
    setWorkerLimit(limit: number): this;
    /** What ends loading: before `onLoad` with an error, later in `geometry.complete`; the geometry stays as it is. */
    setSignal(signal: AbortSignal | undefined): this;
    /** Ends all that is being loaded. */
    abort(): this;
    load(url: string, onLoad: (geometry: UnweldGeometry) => void, onProgress?: (event: ProgressEvent) => void, onError?: (error: unknown) => void): void;
    /** Ends the workers, and what they still load. */
    dispose(): void;
}
/** A geometry that deltas are applied to. Attributes have room for more than `drawRange` shows. */
export declare class UnweldGeometry extends BufferGeometry<Record<string, BufferAttribute>, {
    refine: RefineEvent;
    dispose: object;
}> {
    #private;
    /** What the file holds, once known. */
    contents: Contents | null;
    /** Vertices and triangles of the mesh as it stands. */
    vertices: number;
    triangles: number;
    /** The finest level that has arrived, or `null` before the base has. */
    finest: number | null;
    /** The delta applied last. */
    last: Delta | null;
    /** When vertices were appended last, on `clock`. */
    lastBorn: number;
    /** When all that is wanted is there. */
    readonly complete: Promise<void>;
    /** Follows a stream; with `morph` there are attributes for `geomorph`. */
    constructor(stream: MeshStream, morph?: boolean);
    /** Seconds since loading began: what `geomorph` wants to know. */
    clock(): number;
    /** Shows a level that has arrived, or with `null` the finest; wants `UnweldLoader.levels`. */
    show(level: number | null): Promise<void>;
    /** Goes on after a `ConnectionError`; returns what `complete` would be. */
    resume(): Promise<void>;
    /** Applies what has changed; only that is sent to the graphics card. */
    apply(delta: Delta): void;
}
/**
 * Lets new vertices slide from the edge that they split to their own places (Hoppe, Progressive Meshes, 1996), for a geometry loaded with
 * `morph`. Set `time.value` to `geometry.clock()` before each picture; `seconds.value` is how long it takes, 0 for not at all.
 */
export declare function geomorph(material: Material): {
    time: {
        value: number;
    };
    seconds: {
        value: number;
    };
};
/** The edges of a growing geometry, for `LineSegments`: it shares the positions and follows. */
export declare class UnweldEdges extends BufferGeometry {
    #private;
    constructor(mesh: UnweldGeometry);
    dispose(): void;
}
