import type { Delta, Settings } from "./types.js";
/** What decodes a mesh: a session on this thread, or one in a worker. */
export interface Decoding {
    /** Hands over the next bytes; resolves as soon as there is room for more. */
    push(bytes: Uint8Array): Promise<void>;
    /** Says that no more bytes will come: for good, or (`true`) for now, so that `next` does not wait for them. */
    end(forNow: boolean): Promise<void>;
    /** Forgets all bytes: the file begins anew. */
    restart(): Promise<void>;
    /** What has changed, as soon as something has; `null` where nothing more will. */
    next(): Promise<Delta | null>;
    /** Shows a level that has been decoded, or with `null` the finest. Until that is shown again, decoding rests. */
    show(level: number | null): Promise<Delta>;
    close(): void;
}
export declare class Session implements Decoding {
    #private;
    constructor(settings: Settings);
    push(bytes: Uint8Array): Promise<void>;
    end(forNow: boolean): Promise<void>;
    restart(): Promise<void>;
    next(): Promise<Delta | null>;
    show(level: number | null): Promise<Delta>;
    close(): void;
}
/** The buffers of a delta, which can be transferred. */
export declare function buffersOf(delta: Delta): ArrayBuffer[];
