import type { Settings, Until } from "./types.js";
/** What has changed, in arrays of its own. The module tells which fields there are; a test compares these with them. */
export interface Changes {
    vertices: number;
    triangles: number;
    firstVertex: number;
    firstTriangle: number;
    positions: Float32Array;
    from: Float32Array;
    normals: Float32Array;
    moved: Uint32Array;
    movedPositions: Float32Array;
    turned: Uint32Array;
    turnedNormals: Float32Array;
    indices: Uint32Array;
    rewritten: Uint32Array;
    rewrittenIndices: Uint32Array;
    jump: number;
    alive: Uint32Array;
    firstTold: number;
    firstWedge: number;
    wedges: Uint32Array;
    wedgeIndices: Uint32Array;
    rewrittenWedges: Uint32Array;
    values: Uint8Array;
}
/** Compiles the module, once for each address. */
export declare function compile(url: string | URL | undefined): Promise<WebAssembly.Module>;
/** Takes the module of an address from another thread that has compiled it. */
export declare function provide(url: string | URL | undefined, module: WebAssembly.Module): void;
/** Whether the module is there: nothing is waited for. */
export declare function isCompiled(url: string | URL | undefined): boolean;
/** A decoder. Its methods are those of `unweld::wasm::Client`. */
export declare class Decoder {
    #private;
    constructor(module: WebAssembly.Module, settings: Settings);
    want(until: Until): void;
    /** Bytes of the file from byte `at` on. */
    push(at: number, bytes: Uint8Array): void;
    /** Leaves out resources. */
    skip(numbers: readonly number[]): void;
    /** Adds a resource that was left out; `false` where there is a fault to report. */
    add(number: number, bytes: Uint8Array): boolean;
    /** A resource that is whole. */
    resource(number: number): Uint8Array<ArrayBuffer>;
    /** `true` where there was an event, `false` where more bytes are needed, `"fault"` where there is a fault to report. */
    poll(): boolean | "fault";
    finish(): boolean;
    /** About how many numbers `take` would return. */
    waiting(): number;
    take(): Changes;
    report(): {
        type: string;
    }[];
    /** The level reached, or -1. */
    coarsen(): number;
    /** The level reached, or -1. */
    restore(): number;
}
