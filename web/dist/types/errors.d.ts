/** The base of all errors of this package. */
export declare class UnweldError extends Error {
    name: string;
}
/** The file is damaged or not one. What was decoded before stays valid. */
export declare class FormatError extends UnweldError {
    name: string;
    /** Where, in bytes from the start of the file. */
    readonly offset: number;
    /** The section of the specification that it breaks. */
    readonly section: string;
    /** The atom that holds the fault, if one does. */
    readonly atom: {
        index: number;
        kind: string;
        level: number;
    } | null;
    constructor(fault: Fault);
}
/** The file asks for more memory or work than is allowed. */
export declare class LimitError extends UnweldError {
    name: string;
}
/** The server refuses. */
export declare class HttpError extends UnweldError {
    name: string;
    readonly status: number;
    constructor(url: string, status: number, text: string);
}
/** The connection was lost and could not be made again, or the server has no more of the file. Iterating once more goes on from `received`. */
export declare class ConnectionError extends UnweldError {
    name: string;
    /** Bytes of the file received so far. */
    readonly received: number;
    /** Bytes that are wanted of it, `null` where that is not known yet. */
    readonly wanted: number | null;
    constructor(url: string, received: number, wanted: number | null, cause: unknown);
}
/** A fault as the decoder reports it. */
export interface Fault {
    kind: string;
    message: string;
    offset?: number;
    section?: string;
    atom?: {
        index: number;
        kind: string;
        level: number;
    };
}
/** The error for a fault. */
export declare function errorOf(fault: Fault): UnweldError;
