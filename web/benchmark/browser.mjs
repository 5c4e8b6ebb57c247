// Chromium: lines of a certain speed, loads, and what they cost.

import { readFile, writeFile } from "node:fs/promises";
import { chromium as browserType } from "playwright-core";
import { ARGUMENTS, chromium } from "../tests/chromium.mjs";

export { chromium };

// Sizes of the heap as they are, not rounded and old.
const PRECISE = "--enable-precise-memory-info";

/** A browser with pages of one site. */
export class Browser {
  #browser;
  #site;
  #runs = 0;

  static async start(site) {
    const browser = new Browser();
    browser.#site = site;
    browser.#browser = await browserType.launch({ executablePath: chromium, args: [...ARGUMENTS, PRECISE] });
    return browser;
  }

  version() {
    return this.#browser.version();
  }

  close() {
    return this.#browser.close();
  }

  /** A page in which no loader is yet, its cache off; draw calls are left out. */
  async page() {
    const page = await this.#browser.newPage({ viewport: { width: 1280, height: 800 } });
    const faults = [];
    page.on("pageerror", (error) => faults.push(error));
    page.on("console", (told) => told.type() === "error" && faults.push(new Error(told.text())));
    const control = await page.context().newCDPSession(page);
    await control.send("Network.enable");
    await control.send("Network.setCacheDisabled", { cacheDisabled: true });
    await page.goto(this.#site.url);
    await page.waitForFunction(() => globalThis.stage);
    await page.evaluate(() => globalThis.setDrawing(false));
    return { page, control, faults };
  }

  /** Loads a mesh over a line; see `Stage.load`. */
  async load({ page, control, faults }, kind, path, line, copies = []) {
    await this.#limit(control, null);
    await control.send("HeapProfiler.collectGarbage");
    await this.#limit(control, line);
    const address = `/meshes/${path}?run=${++this.#runs}`;
    const told = await page.evaluate(([kind, address, copies]) => globalThis.stage.load(kind, address, copies), [kind, address, copies]);
    if (faults.length > 0) throw faults[0];
    return told;
  }

  /** As `load`, watched: adds `tasks`, those of the page's thread, and `memory`, the most that the process had above what it had before. */
  async watch(open, kind, path, line) {
    const pids = await this.#renderers();
    await open.control.send("HeapProfiler.collectGarbage");
    const before = await Promise.all(pids.map(resident));
    await this.#browser.startTracing(open.page, {
      categories: ["blink.user_timing", "disabled-by-default-devtools.timeline", "devtools.timeline", "__metadata"],
    });
    const told = await this.load(open, kind, path, line);
    const trace = JSON.parse(await this.#browser.stopTracing());
    const after = await Promise.all(pids.map(peak));
    const memory = Math.max(...after.map((bytes, k) => bytes - before[k]));
    return { ...told, tasks: tasksOf(trace.traceEvents), memory: Number.isFinite(memory) ? memory : null };
  }

  /**
   * Loads a scene in a page of its own; see `page/scene.js`. `cold`: there is no decoder yet; otherwise the same scene has been loaded before, but not
   * drawn. `drawn`: pictures are drawn meanwhile.
   */
  async scene(kind, path, line, { cold = false, drawn = true } = {}) {
    return this.#alone(async (page, limit) => {
      const address = `/meshes/${path}`;
      if (!cold) await page.evaluate(([kind, url]) => globalThis.warm(kind, url), [kind, `${address}?run=${++this.#runs}`]);
      await limit(line);
      return page.evaluate(([kind, url, drawn]) => globalThis.loadScene(kind, url, drawn), [kind, `${address}?run=${++this.#runs}`, drawn]);
    });
  }

  /** Milliseconds that the first picture of a textured box takes that is there already. */
  async floor() {
    return this.#alone((page) => page.evaluate(() => globalThis.drawBox()));
  }

  async #alone(act) {
    const page = await this.#browser.newPage({ viewport: { width: 400, height: 300 } });
    const control = await page.context().newCDPSession(page);
    await control.send("Network.enable");
    await control.send("Network.setCacheDisabled", { cacheDisabled: true });
    await page.goto(`${this.#site.url}/scene`);
    await page.waitForFunction(() => globalThis.loadScene);
    try {
      return await act(page, (line) => this.#limit(control, line));
    } finally {
      await page.close();
    }
  }

  /** Bytes a second that a page and a worker get over a line. */
  async speeds({ page, control }, line) {
    await this.#limit(control, line);
    const speed = async () => {
      const begin = performance.now();
      const { byteLength } = await (await fetch(`${globalThis.origin}/bytes?${Math.random()}`)).arrayBuffer();
      return (1000 * byteLength) / (performance.now() - begin);
    };
    const script = `(${speed})().then(postMessage)`;
    const own = await page.evaluate(speed);
    const workers = await page.evaluate((script) => {
      const address = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
      return new Promise((resolve) => (new Worker(address).onmessage = ({ data }) => resolve(data)));
    }, `globalThis.origin = ${JSON.stringify(this.#site.url)}; ${script}`);
    await this.#limit(control, null);
    return [own, workers];
  }

  /** A line of `{ megabits, latency }`; `null` for one without limits. */
  async #limit(control, line) {
    const throughput = line ? (line.megabits * 1e6) / 8 : -1;
    const conditions = { downloadThroughput: throughput, uploadThroughput: throughput, latency: line?.latency ?? 0 };
    await control.send("Network.emulateNetworkConditions", { offline: false, ...conditions });
  }

  async #renderers() {
    const control = await this.#browser.newBrowserCDPSession();
    const { processInfo } = await control.send("SystemInfo.getProcessInfo");
    await control.detach();
    return processInfo.filter(({ type }) => type === "renderer").map(({ id }) => id);
  }
}

/** Bytes of a process; the peak begins anew with them. */
async function resident(pid) {
  await writeFile(`/proc/${pid}/clear_refs`, "5").catch(() => {});
  return statusOf(pid, "VmRSS");
}

/** Most bytes of a process since `resident`. */
const peak = (pid) => statusOf(pid, "VmHWM");

async function statusOf(pid, field) {
  const status = await readFile(`/proc/${pid}/status`, "utf8").catch(() => "");
  return 1024 * Number(new RegExp(`^${field}:\\s+(\\d+)`, "m").exec(status)?.[1] ?? NaN);
}

/**
 * Tasks of the page's thread during the load, in milliseconds: `whole`; `busy`, what of it a processor was given; `loader`, `whole` without
 * what drawing and normals took.
 */
function tasksOf(events) {
  const mark = (name) => events.find((event) => event.name === name && event.cat.includes("blink.user_timing"));
  const [begin, end] = [mark("bench-begin"), mark("bench-end")];
  const own = events.filter(({ pid, tid }) => pid === begin.pid && tid === begin.tid);
  const spans = own.filter(({ name, ph }) => ph === "b" && /^bench-(draw|normals)$/.test(name));
  const idOf = ({ id, id2 }) => id ?? id2?.local;
  const others = spans.map((open) => {
    const close = own.find((event) => event.ph === "e" && event.name === open.name && idOf(event) === idOf(open) && event.ts >= open.ts);
    return { from: open.ts, to: close?.ts ?? open.ts };
  });
  return own
    .filter(({ name, ph, ts, dur }) => name === "RunTask" && ph === "X" && ts + dur >= begin.ts && ts <= end.ts)
    .map(({ ts, dur, tdur }) => {
      const foreign = others.reduce((sum, { from, to }) => sum + Math.max(0, Math.min(to, ts + dur) - Math.max(from, ts)), 0);
      return { whole: dur / 1000, loader: (dur - foreign) / 1000, busy: (tdur ?? dur) / 1000 };
    });
}
