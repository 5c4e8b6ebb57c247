// A slower line than there is: answers are let through at so many bits a second, so that refinement is seen on one machine.

/** A `fetch` whose answers come at `rate()` Mbit/s, or as fast as they go where that is 0; all of them together, as on one line. */
export function lineOf(rate: () => number): typeof fetch {
  /** When the line is free again. */
  let free = 0;
  const slow = () =>
    new TransformStream<Uint8Array, Uint8Array>({
      start: () => void (free = Math.max(free, performance.now())),
      async transform(bytes, through) {
        for (let at = 0; at < bytes.byteLength; ) {
          const bytesPerSecond = (1e6 * rate()) / 8;
          const end = bytesPerSecond > 0 ? Math.min(bytes.byteLength, at + Math.max(1, bytesPerSecond * TICK)) : bytes.byteLength;
          const piece = bytes.slice(at, (at = Math.ceil(end)));
          if (bytesPerSecond > 0) {
            // A timer that comes late, because the page is drawing, is made good.
            free = Math.max(free, performance.now() - LATEST) + (1000 * piece.byteLength) / bytesPerSecond;
            const wait = free - performance.now();
            if (wait > 1) await new Promise((resolve) => setTimeout(resolve, wait));
          }
          through.enqueue(piece);
        }
      },
    });
  return async (address, init) => {
    const answer = await fetch(address, init);
    if (rate() <= 0 || !answer.body) return answer;
    const { status, statusText, headers } = answer;
    return new Response(answer.body.pipeThrough(slow()), { status, statusText, headers });
  };
}

/** Seconds that a piece takes. */
const TICK = 0.02;
/** Milliseconds that the line may lie idle within an answer and be made use of later. */
const LATEST = 1000;
