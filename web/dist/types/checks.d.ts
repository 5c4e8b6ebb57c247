import type { Until } from "./types.js";
/** Refuses what `Until` does not have: with a `TypeError` that names it. */
export declare function checkUntil(until: Until): void;
/** Refuses a member that is none of those known. */
export declare function checkNames(what: string, given: object, known: readonly string[]): void;
