// Long work in slices.

/** Lets messages come in: a timer would wait for 4 ms. */
export function breath(): Promise<void> {
  const { setImmediate } = globalThis as { setImmediate?: (act: () => void) => void };
  if (setImmediate) return new Promise((resolve) => setImmediate(resolve));
  return new Promise((resolve) => {
    breaths.push(resolve);
    (channel ??= opened()).port1.postMessage(null);
  });
}

const breaths: (() => void)[] = [];
let channel: MessageChannel | null = null;

/** Work on a thread that has others: a turn for whoever waits, after a breath where the turns since the last one have taken long. */
export class Turns {
  #begun = performance.now();
  #last: Promise<void> = Promise.resolve();

  next(): Promise<void> {
    return (this.#last = this.#last.then(() => {
      if (performance.now() - this.#begun < SLICE) return;
      return breath().then(() => void (this.#begun = performance.now()));
    }));
  }
}

/** Milliseconds of turns without a breath. */
const SLICE = 8;

function opened(): MessageChannel {
  const channel = new MessageChannel();
  channel.port2.onmessage = () => breaths.shift()?.();
  return channel;
}
