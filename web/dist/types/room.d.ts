import { BufferAttribute, type TypedArray } from "three";
import type { Numbers } from "./types.js";
/**
 * An attribute for so many numbers, with room for as many as there may be (`most`), if that is but a few times what there is now, for no header's claim
 * shall cost memory: the old one, where it has room. Tells whether it is a new one, which is sent as a whole.
 */
export declare function roomy(old: BufferAttribute | null, type: new (length: number) => Numbers, size: number, numbers: number, most: {
    readonly numbers: number;
    readonly least: number;
}, normalised?: boolean): [attribute: BufferAttribute, fresh: boolean];
/**
 * Tells an attribute how many of its numbers are in use. The renderer sends whole arrays; whatever else reads a geometry, such as bounding boxes and
 * exporters, goes by the count.
 */
export declare function counted(attribute: BufferAttribute, numbers: number): BufferAttribute;
/** Numbers of single items. */
export declare function scatter(array: TypedArray, components: number, places: Uint32Array, values: ArrayLike<number>): void;
/** Marks what has to be sent: items from `first` to `end`, and the blocks that `places` lie in. */
export declare function upload(attribute: BufferAttribute, size: number, first: number, end: number, places?: ArrayLike<number>): void;
