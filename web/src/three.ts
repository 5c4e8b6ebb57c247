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
export class UnweldLoader extends StreamLoader<UnweldGeometry> {
  /** Positions relative to the smallest corner of the bounding box, which is `geometry.contents.min`. */
  relative = false;
  /** Called whenever a geometry has changed, so that a picture can be drawn that is drawn only when it is asked for. */
  onChange: (geometry: UnweldGeometry) => void = () => {};

  override load(
    url: string,
    onLoad: (geometry: UnweldGeometry) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void {
    const path = this.resolve(url);
    const geometry = this.#geometry(path, false);
    let loaded = false;
    this.manager.itemStart(path);
    geometry.addEventListener("refine", ({ delta }) => {
      const [total, done] = [delta.contents.wanted.end, delta.bytes];
      onProgress?.(new ProgressEvent("progress", { lengthComputable: true, loaded: done, total }));
      if (loaded || !delta.level) return;
      loaded = true;
      onLoad(geometry);
      this.manager.itemEnd(path);
    });
    geometry.complete.catch((error: unknown) => {
      if (loaded) return;
      (onError ?? console.error)(error);
      this.manager.itemError(path);
      this.manager.itemEnd(path);
    });
  }

  /**
   * A geometry that is empty, and has nothing fetched, until something is wanted of it: by `geometry.want`, or by an `UnweldPlanner` that its
   * mesh is added to. `until` does not matter to it.
   */
  open(url: string): UnweldGeometry {
    return this.#geometry(this.resolve(url), true);
  }

  #geometry(path: string, waits: boolean): UnweldGeometry {
    const stream = this.stream(path, { waits, relative: this.relative });
    const geometry = new UnweldGeometry(stream, { morph: this.morph, waits });
    geometry.addEventListener("refine", () => this.onChange(geometry));
    return geometry;
  }
}
