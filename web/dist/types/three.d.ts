/** For three.js: a loader whose geometries grow in place while their files arrive, geomorphs, and a planner for several meshes. */
import { Loader, type LoadingManager, type Material } from "three";
import { UnweldGeometry } from "./geometry.js";
import { type Until } from "./unweld.js";
export { UnweldEdges, UnweldGeometry, type GeometryOptions, type RefineEvent } from "./geometry.js";
export { levelFor, pixelError, pixelsPerUnit, UnweldPlanner } from "./scene.js";
/**
 * Loads `.uwm` files. `onLoad` gets the geometry as soon as it shows something, after the first kilobytes, and then the manager is told that
 * it is there; it is refined in place until the file is complete, and dispatches `refine` each time, `complete` or `error` at the end.
 * `geometry.complete` is a promise of that.
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
    /** Whether `geometry.want` will be used. */
    keep: boolean;
    /** Whether `geometry.show` will be used; `want` may be, too. */
    levels: boolean;
    /** Whether new vertices slide to their places: for materials that `geomorph` has changed. */
    morph: boolean;
    /** Bytes that `open` asks for first: mostly header, table of contents and base. */
    head: number;
    /** How often in a row a lost connection is tried again. */
    retries: number;
    /** What makes requests, if not `fetch`. */
    fetch: typeof globalThis.fetch | undefined;
    /** Whether a file that ends early is a prefix, and no fault. */
    prefix: boolean;
    /** Called whenever a geometry has changed, so that a picture can be drawn that is drawn only when it is asked for. */
    onChange: (geometry: UnweldGeometry) => void;
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
    /**
     * A geometry that is empty, and has nothing fetched, until something is wanted of it: by `geometry.want`, or by an `UnweldPlanner` that its
     * mesh is added to. `until` does not matter to it.
     */
    open(url: string): UnweldGeometry;
    /** Ends the workers, and what they still load. */
    dispose(): void;
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
