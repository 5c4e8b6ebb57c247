/** A call of a session's method; `open` and `close` make and end one. `module`: with `open`, where the page has compiled it. */
export interface Call {
    session: number;
    call: number;
    method: "open" | "push" | "add" | "want" | "end" | "restart" | "next" | "show" | "close";
    argument?: unknown;
    module?: WebAssembly.Module | null;
}
/** Its outcome. A delta has no `contents` where they are those of the one before. */
export interface Answer {
    call: number;
    value?: unknown;
    error?: Record<string, unknown>;
}
