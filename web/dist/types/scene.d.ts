import { Sphere, type Camera, type Mesh, type Object3D } from "three";
import type { UnweldGeometry } from "./geometry.js";
import { type Decision, type Measure, type Rules } from "./unweld.js";
/**
 * Pixels that a unit of length in the space of an object takes on the screen, where the object's bounding sphere is nearest to the camera;
 * 0 where it is not in view. `height`: of the picture, in pixels. World matrices are taken as they are.
 */
export declare function pixelsPerUnit(object: Object3D, sphere: Sphere, camera: Camera, height: number): number;
/** The error in pixels of what a mesh shows now, its largest or by another measure; `Infinity` while nothing is shown, 0 out of view. */
export declare function pixelError(mesh: Mesh<UnweldGeometry>, camera: Camera, height: number, measure?: Measure): number;
/**
 * The coarsest level of a mesh whose error is at most so many pixels, for `geometry.want`; `null` before its table of contents is known. With
 * `slack` below 1 it goes down from the level wanted last only to one of at most this share of the error.
 */
export declare function levelFor(mesh: Mesh<UnweldGeometry>, camera: Camera, height: number, pixels?: number, slack?: number, measure?: Measure): number | null;
/** What a planner wants of a geometry, or of all of a scene: `gltf.unweld`. */
export type Refinable = Pick<UnweldGeometry, "contents" | "boundingSphere" | "finest" | "last" | "room" | "show" | "want" | "bytesOf">;
/** What is seen of it. */
export type Refined = Object3D;
/**
 * Lets several meshes share line and memory. Their geometries come from `UnweldLoader.open`.
 *
 * ```js
 * const planner = new UnweldPlanner({ pixels: 1, budget: 200e6 });
 * for (const url of urls) {
 *   const mesh = new Mesh(loader.open(url), material);
 *   scene.add(mesh);
 *   planner.add(mesh);
 * }
 * // before each picture, or when something has moved:
 * planner.update(camera, renderer.domElement.height);
 * ```
 *
 * How it decides stands at `decide`. The budget is that of attributes and indices; the decoders in the workers have memory of their own,
 * which they give back only when a geometry is disposed of.
 */
export declare class UnweldPlanner {
    #private;
    /** The largest error that is good enough, in pixels. */
    pixels: number;
    /** Bytes of all geometries together. */
    budget: number;
    /** Which error of a level that is: the largest, where nothing is said. */
    measure: Measure;
    slack: number;
    lanes: number;
    segment: number;
    /** What was decided last. */
    last: Decision | null;
    /** Called when a mesh cannot be read on; one whose connection was lost goes on with `retry`. */
    onError: (mesh: Refined, error: unknown) => void;
    constructor(rules?: Partial<Omit<Rules, "bytesOf">>);
    /** Takes up a mesh with its geometry, or a scene with what refines it: `add(gltf.scene, gltf.unweld)`. */
    add(mesh: Mesh<UnweldGeometry>): this;
    add(scene: Object3D, refinable: Refinable): this;
    /** Lets go of a mesh, as it is. */
    remove(mesh: Refined): this;
    /** Decides anew: `height` of the picture in pixels. Between calls it goes on by itself with what it saw last. */
    update(camera: Camera, height: number): Decision;
    /** Takes up those again that were lost. */
    retry(): void;
}
