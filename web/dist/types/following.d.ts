import type { Delta, MeshStream, Until } from "./unweld.js";
/** What follows a stream. */
export interface Follower {
    apply(delta: Delta): void;
    /** All that is wanted is there, or a prefix has ended; or it will not be. */
    ended(error?: {
        readonly error: unknown;
    }): void;
}
export declare class Following {
    #private;
    /** The delta applied last. */
    last: Delta | null;
    /** When all that is wanted first is there; rejected with an `AbortError` where it is disposed of before. */
    readonly complete: Promise<void>;
    /** `waits`: nothing is read until something is wanted. `draws`: what comes is drawn so much later as it takes long to draw. */
    constructor(stream: MeshStream, follower: Follower, { waits, draws }?: {
        draws?: boolean | undefined;
        waits?: boolean | undefined;
    });
    /** Shows a level that has arrived, or with `null` the finest. */
    show(level: number | null): Promise<void>;
    /** Wants more or less from now on; resolves when it is there. */
    want(until: Until): Promise<void>;
    /** Goes on after a `ConnectionError`; resolves when all that is wanted is there. */
    resume(): Promise<void>;
    dispose(): void;
}
