// Follows a stream: applies its deltas one after the other, and knows when all that is wanted is there.

import { breath } from "./breath.js";
import type { Delta, MeshStream, Until } from "./unweld.js";

/** What follows a stream. */
export interface Follower {
  apply(delta: Delta): void;
  /** All that is wanted is there, or a prefix has ended; or it will not be. */
  ended(error?: { readonly error: unknown }): void;
}

export class Following {
  /** The delta applied last. */
  last: Delta | null = null;
  /** When all that is wanted first is there; rejected with an `AbortError` where it is disposed of before. */
  readonly complete: Promise<void>;
  readonly #stream: MeshStream;
  readonly #follower: Follower;
  #following: Promise<void> | null = null;
  #first: (reached: Promise<void>) => void = () => {};
  #isDisposed = false;
  /** Milliseconds that the last two pictures with something new took, where these count. */
  #pictures: [number, number] | null;

  /** `waits`: nothing is read until something is wanted. `draws`: what comes is drawn so much later as it takes long to draw. */
  constructor(stream: MeshStream, follower: Follower, { waits = false, draws = false } = {}) {
    this.#pictures = draws ? [0, 0] : null;
    this.#stream = stream;
    this.#follower = follower;
    this.complete = waits ? new Promise((resolve) => (this.#first = resolve)) : this.#follow();
    this.complete.catch(() => {});
  }

  /** Shows a level that has arrived, or with `null` the finest. */
  async show(level: number | null): Promise<void> {
    this.#apply(await this.#stream.show(level));
  }

  /** Wants more or less from now on; resolves when it is there. */
  want(until: Until): Promise<void> {
    const reached = this.#stream.want(until).then(() => this.resume());
    this.#first(reached);
    return reached;
  }

  /** Goes on after a `ConnectionError`; resolves when all that is wanted is there. */
  async resume(): Promise<void> {
    // Something else may have been wanted just when all was there.
    do await this.#follow();
    while (this.#stream.isOpen);
  }

  dispose(): void {
    if (this.#isDisposed) return;
    this.#isDisposed = true;
    this.#stream.close();
    // Where nothing has been wanted yet.
    const gone = Promise.reject(disposed());
    gone.catch(() => {});
    this.#first(gone);
  }

  #follow(): Promise<void> {
    return (this.#following ??= this.#iterate().finally(() => (this.#following = null)));
  }

  async #iterate(): Promise<void> {
    try {
      for (;;) {
        const { done, value } = await this.#stream.next();
        if (this.#isDisposed && !this.last?.complete) throw disposed();
        if (done) break;
        this.#apply(value);
      }
    } catch (error) {
      this.#follower.ended({ error });
      throw error;
    }
    this.#follower.ended();
  }

  #apply(delta: Delta): void {
    const start = performance.now();
    this.last = delta;
    this.#follower.apply(delta);
    // Most of the page's thread is left to others: what would be replaced before it is drawn comes together.
    this.#stream.pace = delta.more ? 0 : Math.min(PACE * (performance.now() - start), MOST_PACE);
    if (!this.#pictures || delta.more) return;
    this.#stream.pace += Math.min(DRAWN_PACE * Math.min(...this.#pictures), MOST_DRAWN_PACE);
    // How long the thread is busy with the next picture. A single one that takes longer has been waiting for shaders.
    globalThis.requestAnimationFrame?.((begun) => {
      void breath().then(() => (this.#pictures = [this.#pictures![1], performance.now() - begun]));
    });
  }
}

/** From one delta to the next so many times what it took to apply one, and this many milliseconds at most; and the same of drawing it. */
const PACE = 4;
const MOST_PACE = 100;
const DRAWN_PACE = 2;
const MOST_DRAWN_PACE = 200;

function disposed(): DOMException {
  return new DOMException("the geometry has been disposed of", "AbortError");
}
