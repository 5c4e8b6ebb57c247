import { WorkerPool } from "./pool.js";
import { type Input, type SourceOptions } from "./source.js";
import type { Contents, Delta, Settings, Until } from "./types.js";
export interface DecodeOptions extends Settings, SourceOptions {
    /** Where to decode: by default workers that all meshes share. */
    pool?: WorkerPool;
    /** Whether the stream stays open when all that is wanted is there, for `want`: until `close`. With `levels` it does anyway. */
    keep?: boolean;
}
/**
 * Decodes a mesh while its bytes arrive.
 *
 * ```js
 * for await (const delta of decode("bunny.uwm")) console.log(delta.triangles);
 * ```
 *
 * Errors: `FormatError`, `LimitError`, `HttpError`, `ConnectionError`, and the reason of the signal; at once a `TypeError` for an option that there is
 * not. Whatever it is, the deltas before it
 * make a valid mesh.
 */
export declare function decode(input: Input, options?: DecodeOptions): MeshStream;
/** A mesh on its way. It can be iterated once, and again after a `ConnectionError` or `want`: then it goes on where it was. */
export declare class MeshStream implements AsyncIterableIterator<Delta> {
    #private;
    /** What the file holds, from the first delta on. */
    contents: Contents | null;
    constructor(input: Input, options: DecodeOptions);
    /** Bytes received so far. */
    get received(): number;
    /** Whether there is more to iterate over. */
    get isOpen(): boolean;
    /** Whether positions are relative to `contents.min`. */
    get relative(): boolean;
    [Symbol.asyncIterator](): this;
    /** What the file holds, before anything of it is taken: the next delta stays the next; `null` where there is none. */
    peek(): Promise<Contents | null>;
    next(): Promise<IteratorResult<Delta, undefined>>;
    /** Ends the stream: what `break` does. */
    return(): Promise<IteratorResult<Delta, undefined>>;
    /**
     * Wants more or less from now on. Where it is more than there is, iterate again, or go on doing so: only bytes that are missing are
     * fetched, by Range. Where it is less, what is there stays, and the stream ends early; `show` goes down.
     */
    want(until: Until): Promise<void>;
    /**
     * The mesh at a level that has been decoded, or with `null` at the finest, as a delta in which everything is new. Until the finest is
     * shown again, decoding rests. Wants the option `levels`.
     */
    show(level: number | null): Promise<Delta>;
    /** Ends the stream and gives back its memory. */
    close(): void;
}
