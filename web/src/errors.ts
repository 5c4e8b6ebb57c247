/** The base of all errors of this package. */
export class UnweldError extends Error {
  override name = "UnweldError";
}

/** The file is damaged or not one. What was decoded before stays valid. */
export class FormatError extends UnweldError {
  override name = "FormatError";
  /** Where, in bytes from the start of the file. */
  readonly offset: number;
  /** The section of the specification that it breaks. */
  readonly section: string;
  /** The atom that holds the fault, if one does. */
  readonly atom: { index: number; kind: string; level: number } | null;
  constructor(fault: Fault) {
    super(fault.message);
    this.offset = fault.offset ?? 0;
    this.section = fault.section ?? "";
    this.atom = fault.atom ?? null;
  }
}

/** The file asks for more memory or work than is allowed. */
export class LimitError extends UnweldError {
  override name = "LimitError";
}

/** The server refuses. */
export class HttpError extends UnweldError {
  override name = "HttpError";
  readonly status: number;
  constructor(url: string, status: number, text: string) {
    super(`${url}: ${status}${text ? ` ${text}` : ""}`);
    this.status = status;
  }
}

/** The connection was lost and could not be made again, or the server has no more of the file. Iterating once more goes on from `received`. */
export class ConnectionError extends UnweldError {
  override name = "ConnectionError";
  /** Bytes of the file received so far. */
  readonly received: number;
  /** Bytes that are wanted of it, `null` where that is not known yet. */
  readonly wanted: number | null;
  constructor(url: string, received: number, wanted: number | null, cause: unknown) {
    const why = cause instanceof Error ? cause.message : String(cause);
    const bytes = wanted === null ? `${received} bytes` : `${received} of the ${wanted} bytes wanted`;
    super(`${url || "the stream"}: lost after ${bytes}: ${why}`, { cause });
    this.received = received;
    this.wanted = wanted;
  }
}

/** A fault as the decoder reports it. */
export interface Fault {
  kind: string;
  message: string;
  offset?: number;
  section?: string;
  atom?: { index: number; kind: string; level: number };
}

/** The error for a fault. */
export function errorOf(fault: Fault): UnweldError {
  if (fault.kind === "format") return new FormatError(fault);
  return fault.kind === "limit" ? new LimitError(fault.message) : new UnweldError(fault.message);
}
