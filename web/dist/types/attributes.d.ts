import type { Attributes, FileAttribute } from "./types.js";
/** The values by name, of so many wedges and triangles: cut out of the bytes in which they lie one after the other. */
export declare function valuesOf(attributes: readonly FileAttribute[], bytes: Uint8Array, { wedges, triangles }: {
    wedges: number;
    triangles: number;
}): Attributes["values"];
