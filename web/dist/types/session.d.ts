import type { Contents, Delta, Settings, Until } from "./types.js";
/** What decodes a mesh: a session on this thread, or one in a worker. */
export interface Decoding {
    /** Hands over bytes of the file from byte `at` on; resolves as soon as there is room for more: with the byte at which what is wanted ends, if known. */
    push(bytes: Uint8Array, at: number): Promise<number | null>;
    /** Hands over a resource that was left out: all bytes that it takes in the file. */
    add(number: number, bytes: Uint8Array): Promise<void>;
    /** Wants something else from now on; resolves with what is then told, if the file is known. */
    want(until: Until): Promise<Contents | null>;
    /** Says whether more bytes will come; where they do not, for now or for good, `next` does not wait for them. */
    end(ended: Ended): Promise<void>;
    /** Forgets all bytes: the file begins anew. */
    restart(): Promise<void>;
    /**
     * What has changed, as soon as something has, but not sooner than `pace` milliseconds after the last time, unless that is all; `null` where nothing more
     * will.
     */
    next(pace: number): Promise<Delta | null>;
    /** Shows a level that has been decoded, or with `null` the finest. Until that is shown again, decoding rests. */
    show(level: number | null): Promise<Delta>;
    close(): void;
}
/** `"prefix"`: for good, and what there is of the file is all that there was to be. */
export type Ended = "no" | "for now" | "for good" | "prefix";
export declare class Session implements Decoding {
    #private;
    constructor(settings: Settings);
    push(bytes: Uint8Array, at: number): Promise<number | null>;
    want(until: Until): Promise<Contents | null>;
    add(number: number, bytes: Uint8Array): Promise<void>;
    end(ended: Ended): Promise<void>;
    restart(): Promise<void>;
    next(pace: number): Promise<Delta | null>;
    show(level: number | null): Promise<Delta>;
    close(): void;
}
/** The buffers of a delta, which can be transferred. */
export declare function buffersOf(delta: Delta): ArrayBuffer[];
