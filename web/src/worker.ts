// The worker: sessions by number, called by messages.

import { buffersOf, Session, type Ended } from "./session.js";
import type { Delta, Settings, Until } from "./types.js";

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

const sessions = new Map<number, Session>();

addEventListener("message", async ({ data }: MessageEvent<Call>) => {
  const { session: number, call, method, argument } = data;
  try {
    const value = await carryOut(number, method, argument);
    const delta = value as Partial<Delta> | null | undefined;
    post({ call, value }, delta?.indices ? buffersOf(delta as Delta) : []);
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
    default:
      return session[method]();
  }
}

function post(answer: Answer, transfer: ArrayBuffer[]): void {
  (postMessage as (message: unknown, transfer: Transferable[]) => void)(answer, transfer);
}
