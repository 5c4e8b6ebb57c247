// What was measured, in words: BENCHMARKS.md and its pictures.

import { readFileSync } from "node:fs";
import { cpus, totalmem } from "node:os";

const LABELS = { unweld: "unweld", draco: "Draco", meshopt: "meshoptimizer" };
const COLOURS = { unweld: "#1668b8", draco: "#c4501b", meshopt: "#3c8a3f" };

/** When what was in the picture, in milliseconds: medians over the runs. */
export function timesOf(runs, diagonal) {
  const when = (is) => median(runs.map(({ moments }) => moments.find(is)?.time ?? NaN));
  const within = (error, percent) => (moment) => moment.complete || moment[error] <= (percent / 100) * diagonal;
  return {
    first: when(() => true),
    max1: when(within("maxError", 1)),
    max01: when(within("maxError", 0.1)),
    rms1: when(within("rmsError", 1)),
    rms01: when(within("rmsError", 0.1)),
    whole: when(({ complete }) => complete),
    normals: median(runs.map(({ normals }) => normals)),
  };
}

/** The report as Markdown. */
export function report({ meshes, results, pictures, speeds, load, runs, cold, decoders, browser, seconds }) {
  const version = (name) => JSON.parse(readFileSync(new URL(`../node_modules/${name}/package.json`, import.meta.url), "utf8")).version;
  const [{ line: slow }, large] = [results[0], meshes.at(-1)];
  return `# Benchmarks in the browser

${[
  `Machine: ${cpus()[0].model}, ${cpus().length} logical cores, ${Math.round(totalmem() / 2 ** 30)} GiB of memory, drawing in software`,
  `Load average at the start: ${load.toFixed(2)}${load > 1 ? "; the machine had other work to do, and times are the longer for it" : ""}`,
  `Chromium ${browser}, headless; three.js ${version("three")} with the decoders that come with it`,
  `Files by draco3d ${version("draco3d")}, meshoptimizer ${version("meshoptimizer")}, glTF Transform ${version("@gltf-transform/core")}`,
  `Command: \`web/bench\`, ${Math.round(seconds)} s; medians of ${runs} loads, "cold" of ${cold} in a page that had no decoder yet`,
].map((line) => `- ${line}`).join("\n")}

Three.js loads the same triangles, as \`.uwm\` with \`UnweldLoader\`, as glTF with KHR_draco_mesh_compression (\`DRACOLoader\`), as glTF with
EXT_meshopt_compression (\`MeshoptDecoder\` with two workers): welded by position, no attribute but positions, at ${large.bits} bits a coordinate, Draco at its
best (level 10). One browser, the loaders in turn. The line is emulated by Chromium: at ${slow.megabits} Mbit/s a page got ${megabits(speeds[0])} and a worker ${megabits(speeds[1])} of
a megabyte, latency included. Files that brotli makes smaller are sent with it.

![${large.name} at ${slow.megabits} Mbit/s: error over time](pictures/error.png)

## Bytes

${table(
  ["mesh", "vertices", "triangles", ...Object.values(LABELS), "meshoptimizer without brotli", "unweld/Draco"],
  meshes.map(({ name, vertices, triangles, files }) => [
    ...[name, count(vertices), count(triangles), ...Object.keys(LABELS).map((kind) => count(files[kind].sent.length))],
    ...[count(files.meshopt.bytes.length), (files.unweld.sent.length / files.draco.sent.length).toFixed(2)],
  ]),
)}

What a page that has three.js fetches besides, minified and with brotli, GLTFLoader included where it is wanted: ${Object.entries(decoders)
    .map(([kind, bytes]) => `${LABELS[kind]} ${count(bytes)}`)
    .join(", ")}.

## Seconds from \`load()\`
${results.map(({ mesh, line, told }) => section(mesh, line, told)).join("\n")}
A time is that of the first frame after the one that was drawn with it. Errors are those in the table of contents, the largest and the root mean square
distance of the input from the level, in % of the diagonal; the other two show nothing before they show all. Normals: what
\`computeVertexNormals\` takes of the page's thread for them, part of "whole"; UnweldLoader brings normals, made in its worker. Who shades flat, as
GLTFLoader does without normals, does not wait for them: "whole, no normals". Chromium draws in software here, a second and more for a picture of such a mesh; so
draw calls are left out while the clock runs, uploads are not.

## What it costs the page

${table(
  [
    ...["mesh", "Mbit/s", "loader", "longest task of loader or decoder ms", "longest task ms", "of it running ms", "tasks above 50 ms"],
    ...["peak script heap MB", "peak of the process above its start MB"],
  ],
  results.flatMap(({ mesh, line, told }) =>
    Object.keys(LABELS).map((kind) => {
      const { tasks, heap, memory } = told[kind].watched;
      const longest = (what) => Math.max(...tasks.map((task) => task[what])).toFixed(0);
      const running = tasks.reduce((a, b) => (a.whole > b.whole ? a : b)).busy.toFixed(0);
      const many = tasks.filter(({ whole }) => whole > 50).length;
      const sizes = [heap, memory].map((bytes) => (bytes === null ? "-" : mega(bytes)));
      return [mesh.name, line.megabits, LABELS[kind], longest("loader"), longest("whole"), running, many, ...sizes];
    }),
  ),
)}

One load each, traced, in a fresh page with the decoder there. Tasks are those of the page's thread; of loader or decoder: without three.js's part of a picture (uploads)
and without \`computeVertexNormals\`, which count in the longest task; running: less what it waited for a processor. Script heap: the page's own (\`performance.memory\`), at the most at any
frame. Process: resident memory of the page's process, workers, WebAssembly and buffers included.

## Aims

${table(["", "measured", "aim", ""], aims(results, decoders))}

## What is to be seen when

![${large.name} at ${slow.megabits} Mbit/s after ${pictures.times.map((time) => time / 1000).join(", ")} seconds, with the three loaders](pictures/stream.png)

${large.name} at ${slow.megabits} Mbit/s. The meshes that were there at these times, copied during a load as above, and drawn afterwards.
`;
}

/** Draws the pictures in a page: `{ times, files }`. */
export async function pictures(page, { mesh, rows, times, size, results }) {
  const shoot = async (name, ...args) => {
    await page.evaluate(async ([name, args]) => (await import("/pictures.js"))[name](...args), [name, args]);
    return page.locator("#picture").screenshot({ type: "png", animations: "disabled" });
  };
  const { told, line } = results.find((result) => result.mesh === mesh);
  const title = `${mesh.name}, ${count(mesh.triangles)} triangles, ${line.megabits} Mbit/s`;
  const error = await shoot("chart", title, ...curves(told, mesh));
  const cells = ({ picture, triangles, maxError } = {}) => {
    if (!triangles) return { picture: null, text: "" };
    const near = maxError === undefined ? "" : `, error ${((100 * maxError) / mesh.diagonal).toPrecision(2)} %`;
    return { picture, text: `${count(triangles)} triangles${near}` };
  };
  const laid = rows.map(({ kind, cells: drawn }) => ({ label: LABELS[kind], cells: drawn.map((cell) => cells(cell ?? undefined)) }));
  return { times, files: { "error.png": error, "stream.png": await shoot("sheet", times, laid, ...size) } };
}

/** The largest error over time, of the run with the median end. */
function curves(told, { diagonal, files }) {
  const middle = ({ warm }) => [...warm].sort((a, b) => a.moments.at(-1).time - b.moments.at(-1).time)[Math.floor(warm.length / 2)];
  const finest = (100 * middle(told.unweld).moments.at(-1).maxError) / diagonal;
  const ends = Object.values(told).map((each) => middle(each).moments.at(-1).time / 1000);
  const drawn = Object.entries(told).map(([kind, each]) => {
    const error = ({ maxError }) => (maxError === undefined ? finest : (100 * maxError) / diagonal);
    const points = middle(each).moments.map((moment) => ({ x: moment.time / 1000, y: error(moment) }));
    // Before the first picture nothing is right.
    points.unshift({ x: points[0].x, y: 100 });
    return { label: `${LABELS[kind]}, ${count(files[kind].sent.length)} bytes`, colour: COLOURS[kind], points };
  });
  return [drawn, Math.ceil(2.2 * Math.max(...ends)) / 2];
}

function section(mesh, line, told) {
  const rows = Object.keys(LABELS).map((kind) => {
    const [warm, cold] = [timesOf(told[kind].warm, mesh.diagonal), timesOf(told[kind].cold, mesh.diagonal)];
    const { first, max1, max01, rms1, rms01, whole, normals } = warm;
    const shown = [first, rms1, rms01, max1, max01, whole, whole - normals].map(inSeconds);
    return [LABELS[kind], ...shown, inSeconds(cold.first), inSeconds(cold.whole)];
  });
  const heads = ["first picture", "rms 1 %", "rms 0.1 %", "max 1 %", "max 0.1 %", "whole", "whole, no normals", "cold: first", "cold: whole"];
  return `
### ${mesh.name}, ${line.megabits} Mbit/s, ${line.latency} ms

${table(["", ...heads], rows)}
`;
}

/** What was aimed at, and what became of it. */
function aims(results, decoders) {
  const { mesh, told } = results.filter(({ line }) => line === results[0].line).at(-1);
  const [unweld, draco] = ["unweld", "draco"].map((kind) => timesOf(told[kind].warm, mesh.diagonal));
  const task = Math.max(...results.flatMap(({ told }) => told.unweld.watched.tasks.map(({ loader }) => loader)));
  const row = (what, value, most, digits = 2) => [what, value.toFixed(digits), `at most ${most}`, value <= most ? "reached" : "missed"];
  const where = `${mesh.name} at ${results[0].line.megabits} Mbit/s`;
  return [
    row(`${where}: first picture, over Draco's`, unweld.first / draco.first, 0.25),
    row(`${where}: whole, over Draco's`, unweld.whole / draco.whole, 1.25),
    row(`${where}: whole, over Draco's without normals`, unweld.whole / (draco.whole - draco.normals), 1.25),
    row("longest task of loader or decoder, ms", task, 50, 0),
    row("decoder and loader, kB with brotli", decoders.unweld / 1000, 150, 0),
  ];
}

function table(heads, rows) {
  const line = (cells) => `| ${cells.join(" | ")} |`;
  return [line(heads), `|${heads.map((_, k) => (k === 0 ? "---" : "---:")).join("|")}|`, ...rows.map(line)].join("\n");
}

function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

const count = (number) => number.toLocaleString("en");
const inSeconds = (milliseconds) => (milliseconds / 1000).toFixed(2);
const mega = (bytes) => (bytes / 1e6).toFixed(0);
const megabits = (bytes) => `${((8 * bytes) / 1e6).toFixed(1)} Mbit/s`;
