// What arrived when: bytes and triangles over time, with a mark for each level.

interface Moment {
  seconds: number;
  bytes: number;
  triangles: number;
  levels: number;
}

export class Timeline {
  readonly #canvas: HTMLCanvasElement;
  #begin = performance.now();
  #moments: Moment[] = [];
  #most = { bytes: 1, triangles: 1 };

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    new ResizeObserver(() => this.#draw()).observe(canvas);
  }

  begin(): void {
    this.#begin = performance.now();
    this.#moments = [];
    this.#draw();
  }

  add(moment: Omit<Moment, "seconds">, most: { bytes: number; triangles: number }): void {
    this.#most = most;
    this.#moments.push({ ...moment, seconds: (performance.now() - this.#begin) / 1000 });
    this.#draw();
  }

  /** In words: when the first shape was there, and when all of it. */
  words(complete: boolean): string {
    const [first, last] = [this.#moments.find(({ triangles }) => triangles > 0), this.#moments.at(-1)];
    if (!first || !last) return "";
    const begin = `first shape after ${first.seconds.toFixed(2)} s`;
    return complete ? `${begin}, all after ${last.seconds.toFixed(2)} s` : begin;
  }

  #draw(): void {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const scale = Math.min(devicePixelRatio, 2);
    this.#canvas.width = width * scale;
    this.#canvas.height = height * scale;
    const pen = this.#canvas.getContext("2d");
    const last = this.#moments.at(-1);
    if (!pen || !last) return;
    pen.scale(scale, scale);
    const [left, bottom] = [0, height - 14];
    const x = (seconds: number) => left + (width - left) * (seconds / Math.max(last.seconds, 0.001));
    const y = (share: number) => bottom - (bottom - 4) * Math.min(1, share);
    pen.strokeStyle = "#31363f";
    pen.beginPath();
    for (const { seconds, levels } of this.#moments) {
      if (levels > 0) {
        pen.moveTo(x(seconds), bottom);
        pen.lineTo(x(seconds), 4);
      }
    }
    pen.stroke();
    const line = (colour: string, share: (moment: Moment) => number) => {
      pen.strokeStyle = colour;
      pen.lineWidth = 1.5;
      pen.beginPath();
      pen.moveTo(x(0), y(0));
      for (const moment of this.#moments) pen.lineTo(x(moment.seconds), y(share(moment)));
      pen.stroke();
    };
    line("#5fb0ff", ({ bytes }) => bytes / this.#most.bytes);
    line("#ffc766", ({ triangles }) => triangles / this.#most.triangles);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = "#5fb0ff";
    pen.fillText("bytes", 0, height - 2);
    pen.fillStyle = "#ffc766";
    pen.fillText("triangles", 36, height - 2);
    pen.fillStyle = "#aab1bc";
    pen.textAlign = "right";
    pen.fillText(`${last.seconds.toFixed(2)} s`, width, height - 2);
  }
}
