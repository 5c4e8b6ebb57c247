/** What a mesh can be decoded from. With an address, a broken connection is taken up again where it broke. */
export type Input = string | URL | Request | Response | Promise<Response> | Blob | ArrayBuffer | Uint8Array | ReadableStream<Uint8Array> | AsyncIterable<Uint8Array>;
export interface SourceOptions {
    signal?: AbortSignal | undefined;
    /** How often in a row a connection is tried again, after 0.5, 1, 2, 4 … seconds; 5 by default. */
    retries?: number | undefined;
    /** For requests that this package makes. */
    request?: RequestInit | undefined;
    /** What makes those requests, `fetch` by default. */
    fetch?: typeof globalThis.fetch | undefined;
    /** Bytes to ask for first, when only a part will be wanted; by default the answer is cut off where it is no longer wanted. */
    head?: number | undefined;
    /** Whether an input that ends early is a prefix of a file, and no fault; one that a server calls so (`Unweld-Bytes`) always is. */
    prefix?: boolean | undefined;
}
/** Reads an input from its first byte. */
export declare class Source {
    #private;
    /** Bytes returned by `read` since the last `"restart"`. */
    received: number;
    /** Bytes that are wanted, once known: less is a connection lost, and no more are asked for. */
    expected: number | null;
    /** Where no bytes are wanted: they are jumped over where that saves something. */
    holes: readonly (readonly [number, number])[];
    /** Whether the input has ended. */
    isOver: boolean;
    /** Whether it has ended as a prefix of the file: what is wanted is not all there, and no fault. */
    isPrefix: boolean;
    /** Where to ask again; empty where that is impossible. */
    url: string;
    constructor(input: Input, options: SourceOptions);
    /** Whether there is nothing to read: what is wanted is there, or the input has ended. */
    get isSatisfied(): boolean;
    /** The next bytes; `null` at the end; `"restart"` where the file is another one now and begins anew. */
    read(): Promise<Uint8Array | "restart" | null>;
    /** Bytes of the file from one to the one before `to`, whatever is read otherwise. */
    part([from, to]: readonly [number, number]): Promise<Uint8Array>;
    /** Lets go of the connection, if it can be taken up again; else it waits. */
    rest(): void;
    /** Reads no further. */
    cancel(): void;
}
