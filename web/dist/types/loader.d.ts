import { Loader, type LoadingManager } from "three";
import { type MeshStream, type Until } from "./unweld.js";
/** Loads files that go on refining once they are there. */
export declare abstract class StreamLoader<T> extends Loader<T> {
    #private;
    /** How far to decode. */
    until: Until;
    /** Whether `want` will be used. */
    keep: boolean;
    /** Whether `show` will be used; `want` may be, too. */
    levels: boolean;
    /** Whether new vertices slide to their places. */
    morph: boolean;
    /** Bytes that are asked for first where only a part will be wanted: mostly header, table of contents and base. */
    head: number;
    /** How often in a row a lost connection is tried again. */
    retries: number;
    /** What makes requests, if not `fetch`. */
    fetch: typeof globalThis.fetch | undefined;
    /** Whether a file that ends early is a prefix, and no fault. */
    prefix: boolean;
    /** Where `worker.js` and `unweld.wasm` are, if not beside the script. */
    workerUrl: string | URL | undefined;
    wasmUrl: string | URL | undefined;
    constructor(manager?: LoadingManager);
    /** Most workers. */
    setWorkerLimit(limit: number): this;
    /** What ends loading: before `onLoad` with an error, later in `complete`; what is shown stays as it is. */
    setSignal(signal: AbortSignal | undefined): this;
    /** Starts a worker and has the module fetched and compiled before there is anything to load: for pages that will load something later. */
    preload(): Promise<void>;
    /** Ends all that is being loaded. */
    abort(): this;
    /** Ends the workers, and what they still load. */
    dispose(): void;
    /** The address in full. */
    protected resolve(url: string): string;
    /** A stream of a file; one that `waits` has nothing fetched until something is wanted. */
    protected stream(path: string, { waits, relative, resources }: {
        relative?: boolean | undefined;
        resources?: boolean | undefined;
        waits?: boolean | undefined;
    }): MeshStream;
}
/** Numbers that are applied to a scene at a time: its buffers take longer than those of one mesh. */
export declare const SCENE_MOST = 200000;
