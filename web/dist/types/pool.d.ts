import { type Decoding } from "./session.js";
import type { Settings } from "./types.js";
/** A number of workers, made when they are wanted. */
export declare class WorkerPool {
    #private;
    /** Most workers; 0 decodes on the calling thread. */
    limit: number;
    /** `url`: where `worker.js` is, if not beside the script. */
    constructor(limit?: number, url?: string | URL);
    /** Starts a worker and has the module compiled, before there is anything to decode; `wasm`: where the module is, if not beside the script. */
    preload(wasm?: string | URL): Promise<void>;
    /** Whether a mesh that is opened now is decoded as soon as bytes come. */
    isReady(settings: Settings): boolean;
    /** A decoder in the worker that has the fewest. */
    open(settings: Settings): Decoding;
    /** Ends all workers, and with them what they decode. */
    dispose(): void;
}
