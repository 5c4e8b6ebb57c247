import type { Level, Measure } from "./types.js";
/** What the planner wants to know of a mesh. */
export interface Standing {
    /** Its levels by number, from the table of contents; `null` before that is known. */
    readonly levels: readonly Level[] | null;
    /** Pixels that a unit of length takes on the screen, where the mesh is nearest; 0 out of view. */
    readonly scale: number;
    /** The finest level that has arrived, `null` before the base has. */
    readonly arrived: number | null;
    /** The finest level that there is to be had, where the file has ended as a prefix. */
    readonly last?: number;
    /** Its goal as it was decided last, `null` if it never was. */
    readonly goal: number | null;
    /** The level that it is read up to now, `null` where it is not read. */
    readonly turn: number | null;
}
/** What the planner goes by. */
export interface Rules {
    /** The largest error on the screen that is good enough, in pixels. */
    readonly pixels: number;
    /** Which error of a level that is; `"max"` where nothing is said. */
    readonly measure?: Measure;
    /** A mesh goes down when a coarser level has at most this share of that error; from 0 to 1. */
    readonly slack: number;
    /** Bytes of all geometries together. */
    readonly budget: number;
    /** How many meshes are read at a time. */
    readonly lanes: number;
    /** Bytes that a turn takes at least, if there are so many. */
    readonly segment: number;
    /** Bytes of a geometry at a level. */
    readonly bytesOf: (level: Level) => number;
}
/** What is decided for a mesh. */
export interface Step {
    /** The level it is to show in the end, `null` before its table of contents is known. */
    readonly goal: number | null;
    /** The level to show instead of the finest that has arrived, `null` for that. */
    readonly show: number | null;
    /** The level to read up to now, `Infinity` for the base, `null` to rest. */
    readonly read: number | null;
}
/** What is decided for all of them. */
export interface Decision {
    /** By mesh, in their order. */
    readonly steps: Step[];
    /** The tolerance that the budget allows: `Infinity` where not even it does. */
    readonly pixels: number;
    /** Bytes of all geometries at their goals. */
    readonly bytes: number;
}
/** Decides. It remembers nothing: goals and turns are given back to it. */
export declare function decide(meshes: readonly Standing[], rules: Rules): Decision;
/** The coarsest level with at most this error in the units of the mesh; 0 where none is so close. */
export declare function levelWithin(levels: readonly Level[], error: number, measure?: Measure): number;
/** One of the errors of a level. */
export declare function errorOf({ maxError, rmsError }: Level, measure?: Measure): number;
