/** A call of a session's method; `open` and `close` make and end one. */
export interface Call {
    session: number;
    call: number;
    method: "open" | "push" | "add" | "want" | "end" | "restart" | "next" | "show" | "close";
    argument?: unknown;
}
/** Its outcome. */
export interface Answer {
    call: number;
    value?: unknown;
    error?: Record<string, unknown>;
}
