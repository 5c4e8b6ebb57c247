// The worker: sessions by number, called by messages.

import { provide } from "./module.js";
import { buffersOf, Session, type Ended } from "./session.js";
import type { Contents, Delta, Settings, Until } from "./types.js";

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

const sessions = new Map<number, Session>();
/** What the page has been told last of the file that a session decodes: it is not told again with every delta. */
const known = new Map<number, Contents>();

addEventListener("message", async ({ data }: MessageEvent<Call>) => {
  const { session: number, call, method, argument, module } = data;
  try {
    if (module) provide((argument as Settings).wasm, module);
    const value = await carryOut(number, method, argument);
    if (isDelta(value)) {
      const isKnown = known.get(number) === value.contents;
      known.set(number, value.contents);
      post({ call, value: isKnown ? { ...value, contents: null } : value }, buffersOf(value));
    } else post({ call, value }, []);
  } catch (error) {
    const { name, message } = error as Error;
    post({ call, error: { ...(error as object), name, message } }, []);
  }
});

function carryOut(number: number, method: Call["method"], argument: unknown): unknown {
  if (method === "open") return void sessions.set(number, new Session(argument as Settings));
  const session = sessions.get(number);
  if (!session) throw new Error("the stream is closed");
  switch (method) {
    case "close":
      sessions.delete(number);
      known.delete(number);
      return session.close();
    case "push":
      return session.push(...(argument as [Uint8Array, number]));
    case "add":
      return session.add(...(argument as [number, Uint8Array]));
    case "want":
      return session.want(argument as Until);
    case "end":
      return session.end(argument as Ended);
    case "show":
      return session.show(argument as number | null);
    case "next":
      return session.next(argument as number);
    default:
      return session[method]();
  }
}

function isDelta(value: unknown): value is Delta {
  return (value as Partial<Delta> | null | undefined)?.indices !== undefined;
}

function post(answer: Answer, transfer: ArrayBuffer[]): void {
  (postMessage as (message: unknown, transfer: Transferable[]) => void)(answer, transfer);
}
