/** For three.js: a loader whose geometries grow in place while their files arrive, geomorphs, and a planner for several meshes. */
import { UnweldGeometry } from "./geometry.js";
import { StreamLoader } from "./loader.js";
export { UnweldEdges, UnweldGeometry, type GeometryOptions, type RefineEvent } from "./geometry.js";
export { geomorph, type Slide } from "./geomorph.js";
export { levelFor, pixelError, pixelsPerUnit, UnweldPlanner, type Refinable, type Refined } from "./scene.js";
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
export declare class UnweldLoader extends StreamLoader<UnweldGeometry> {
    #private;
    /** Positions relative to the smallest corner of the bounding box, which is `geometry.contents.min`. */
    relative: boolean;
    /** Called whenever a geometry has changed, so that a picture can be drawn that is drawn only when it is asked for. */
    onChange: (geometry: UnweldGeometry) => void;
    load(url: string, onLoad: (geometry: UnweldGeometry) => void, onProgress?: (event: ProgressEvent) => void, onError?: (error: unknown) => void): void;
    /**
     * A geometry that is empty, and has nothing fetched, until something is wanted of it: by `geometry.want`, or by an `UnweldPlanner` that its
     * mesh is added to. `until` does not matter to it.
     */
    open(url: string): UnweldGeometry;
}
