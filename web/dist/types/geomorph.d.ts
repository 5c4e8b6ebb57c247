import type { Material } from "three";
/** Uniforms of materials that `geomorph` has changed. */
export interface Slide {
    readonly time: {
        value: number;
    };
    readonly seconds: {
        value: number;
    };
}
/**
 * Lets new vertices slide from the edge that they split to their own places (Hoppe, Progressive Meshes, 1996), for a geometry loaded with
 * `morph`. Set `time.value` to `geometry.clock()` before each picture; `seconds.value` is how long it takes, 0 for not at all.
 */
export declare function geomorph(material: Material, slide?: Slide): Slide;
