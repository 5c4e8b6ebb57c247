import { BufferAttribute } from "three";
import type { Attributes, FileAttribute } from "./unweld.js";
/** Buffers by wedge. */
export interface Dress {
    readonly attributes: Readonly<Record<string, BufferAttribute>>;
    readonly index: BufferAttribute;
    readonly groups: readonly Group[];
    /** Whether the file has normals, and one for each triangle. */
    readonly flat: boolean;
}
/** Indices of one part. */
export interface Group {
    readonly part: number;
    readonly start: number;
    readonly count: number;
}
/** The buffers of a mesh whose vertices have these positions and normals. */
export declare function dressOf({ vertices, indices, values }: Attributes, file: readonly FileAttribute[], position: ArrayLike<number>, normal: ArrayLike<number>): Dress;
