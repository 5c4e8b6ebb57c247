// `web/bench --scenes`: whole scenes with their textures, as .uwm, as glTF with Draco, as gltfpack packs them; bytes, first picture, 30 dB, all.

import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { copyFile, mkdir, readFile, readdir, rename, rm, writeFile } from "node:fs/promises";
import { loadavg } from "node:os";
import { basename, join } from "node:path";
import { brotliCompressSync, constants } from "node:zlib";
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS, KHRDracoMeshCompression } from "@gltf-transform/extensions";
import draco3d from "draco3d";
import { decode, WorkerPool } from "../dist/unweld.js";
import { Browser } from "./browser.mjs";
import { serve } from "./site.mjs";

const KINDS = ["unweld", "draco", "meshopt"];
const LINES = [{ megabits: 10, latency: 50 }, { megabits: 100, latency: 10 }];

/**
 * The report, as Markdown, of scenes (.glb or .gltf). `gltfpack`: its program, `needle`: the folder of @needle-tools/gltf-build-pipeline; what there is not of
 * these has no column.
 */
export async function measureScenes(inputs, unweld, { cache, runs, cold, json, gltfpack, needle }) {
  const load = loadavg()[0];
  const kinds = KINDS.filter((kind) => kind !== "meshopt" || gltfpack);
  const scenes = [];
  for (const input of inputs) scenes.push(await prepared(input, unweld, cache, { gltfpack, needle }));
  const site = await serve(scenes);
  const browser = await Browser.start(site);
  const rows = [];
  const floors = [];
  try {
    for (let run = 0; run < runs; run++) floors.push(await browser.floor());
    for (const line of LINES) {
      for (const scene of scenes) {
        const told = Object.fromEntries(kinds.map((kind) => [kind, { drawn: [], undrawn: [], cold: [] }]));
        const ways = { drawn: {}, undrawn: { drawn: false }, cold: { cold: true, drawn: false } };
        for (const [way, how] of Object.entries(ways)) {
          for (let run = 0; run < (way === "cold" ? cold : runs); run++) {
            for (let k = 0; k < kinds.length; k++) {
              const kind = kinds[(k + run) % kinds.length];
              told[kind][way].push(await browser.scene(kind, scene.files[kind].path, line, how));
            }
          }
        }
        rows.push({ line, scene, told });
      }
    }
    if (json) await writeFile(json, JSON.stringify({ floors, rows }, (key, value) => (["bytes", "sent"].includes(key) && typeof value === "object" ? undefined : value), 1));
    return report({ rows, scenes, kinds, load, runs, cold, floors, decoders: site.sceneDecoders, browser: browser.version() });
  } finally {
    await browser.close();
    site.close();
  }
}

async function prepared(input, unweld, cache, { gltfpack, needle }) {
  const name = basename(input).replace(/\.(glb|gltf)$/i, "");
  const place = join(cache, `scene-${name}`);
  await mkdir(place, { recursive: true });
  const paths = { unweld: join(place, "unweld.uwm"), draco: join(place, "draco.glb"), meshopt: join(place, "meshopt.glb") };
  execFileSync(unweld, ["encode", "--quiet", input, "-o", paths.unweld], { stdio: ["ignore", "ignore", "inherit"] });
  if (!existsSync(paths.draco)) {
    const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
      "draco3d.encoder": await draco3d.createEncoderModule(),
      "draco3d.decoder": await draco3d.createDecoderModule(),
    });
    const document = await io.read(input);
    const options = { method: KHRDracoMeshCompression.EncoderMethod.EDGEBREAKER, encodeSpeed: 0, decodeSpeed: 0 };
    const bits = { POSITION: 14, NORMAL: 10, COLOR: 8, TEX_COORD: 12, GENERIC: 12 };
    document.createExtension(KHRDracoMeshCompression).setRequired(true).setEncoderOptions({ ...options, quantizationBits: bits });
    await writeFile(paths.draco, await io.writeBinary(document));
  }
  if (gltfpack && !existsSync(paths.meshopt)) execFileSync(gltfpack, ["-cc", "-kn", "-km", "-i", input, "-o", paths.meshopt], { stdio: ["ignore", "ignore", "inherit"] });
  const files = {};
  for (const [kind, path] of Object.entries(paths)) {
    if (!existsSync(path)) continue;
    const bytes = await readFile(path);
    const packed = withBrotli(bytes);
    const pays = kind !== "unweld" && packed.length < 0.98 * bytes.length;
    files[kind] = { path: `${name}/${basename(path)}`, bytes, sent: pays ? packed : bytes, encoding: pays ? "br" : null };
  }
  // Header, table, base, and what stands right behind it: document, small previews, what animations are made of.
  const stream = decode(files.unweld.bytes, { pool: new WorkerPool(0), resources: true });
  const { levels } = await stream.peek();
  stream.close();
  return { name, files, first: levels.at(-1).end, needle: needle ? await ofNeedle(input, join(place, "needle"), needle) : null };
}

/** What gltf-progressive fetches: `first`, the file that names all others, which shows the coarsest level and small textures, and all of them. */
async function ofNeedle(input, place, pipeline) {
  const file = basename(input);
  if (!existsSync(place)) {
    const work = `${place}.part`;
    await rm(work, { recursive: true, force: true });
    await mkdir(work, { recursive: true });
    await copyFile(input, join(work, file));
    for (const [script, ...rest] of [["make-progressive.mjs", join(work, file), "--no-caching"], ["pack-gltf.mjs", work]]) {
      execFileSync(process.execPath, [join(pipeline, script), ...rest], { stdio: "ignore" });
    }
    await rename(work, place);
  }
  const size = async (name) => {
    const bytes = await readFile(join(place, name));
    return Math.min(bytes.length, withBrotli(bytes).length);
  };
  const sizes = await Promise.all((await readdir(place)).map(size));
  return { first: await size(file), all: sizes.reduce((a, b) => a + b, 0) };
}

function withBrotli(bytes) {
  return brotliCompressSync(bytes, { params: { [constants.BROTLI_PARAM_QUALITY]: 9 } });
}

function report({ rows, scenes, kinds, load, runs, cold, floors, decoders, browser }) {
  const median = (list) => [...list].sort((a, b) => a - b)[Math.floor(list.length / 2)];
  const when = (list, is) => median(list.map(({ pictures }) => pictures.find(is)?.time ?? NaN)) / 1000;
  const n = (x, digits = 2) => (Number.isFinite(x) ? x.toFixed(digits) : "–");
  const count = (x) => Math.round(x).toLocaleString("en");
  const table = (head, lines) => [head, head.map(() => "---"), ...lines].map((cells) => `| ${cells.join(" | ")} |`).join("\n");
  return `# Scenes in the browser

- Chromium ${browser}, drawing in software; load average at the start ${load.toFixed(1)}${load > 1 ? ": the machine had other work to do, and times are the longer for it" : ""}
- Medians of ${runs}, of ${cold} where the page has no decoder yet; \`web/bench --scenes\`; Draco at level 10, its files and those of gltfpack -cc sent with brotli where that is less

Loader and decoder with brotli, GLTFLoader not counted: ${Object.entries(decoders).map(([kind, bytes]) => `${kind} ${count(bytes)}`).join(", ")} bytes.

## Bytes

${table(
  ["scene", ...kinds, "unweld/Draco", "first picture", "of Draco's file", ...(scenes[0].needle ? ["needle: all", "first picture", "of Draco's file"] : [])],
  scenes.map(({ name, files, first, needle }) => {
    const draco = files.draco.sent.length;
    const others = needle ? [count(needle.all), count(needle.first), n(needle.first / draco, 3)] : [];
    return [name, ...kinds.map((kind) => count(files[kind].sent.length)), n(files.unweld.sent.length / draco), count(first), n(first / draco, 3), ...others];
  }),
)}

needle: what \`@needle-tools/gltf-build-pipeline\` makes for \`@needle-tools/gltf-progressive\`, levels and textures in files of their own, packed with Draco; all of them with brotli where
that is less, though a page fetches only those that it shows.

## Seconds from load()

In a page that has loaded the same scene before, but has drawn nothing yet. First picture with textures; as near to the last as 30 dB; all there; the longest task of the
page's thread in milliseconds, drawing left out. Undrawn: the same without drawing, when the loader had something to draw, and when all was there. Cold: undrawn in a
page that has three.js, but no decoder yet. Chromium draws in software here: of each first picture ${n(median(floors) / 1000)} s are shaders and drawing that a textured box
takes which is there already, with each loader.

${table(
  ["line", "scene", "loader", "first", "30 dB", "whole", "longest task", "undrawn: first", "whole", "cold: first", "whole"],
  rows.flatMap(({ line, scene, told }) =>
    kinds.map((kind) => {
      const { drawn, undrawn, cold } = told[kind];
      const whole = (list) => n(median(list.map(({ whole }) => whole)) / 1000);
      const first = (list) => n(when(list, () => true));
      return [
        ...[`${line.megabits} Mbit/s`, scene.name, kind, first(drawn), n(when(drawn, ({ psnr }) => psnr >= 30)), whole(drawn)],
        ...[n(median(drawn.map(({ longest }) => longest)), 0), first(undrawn), whole(undrawn), first(cold), whole(cold)],
      ];
    }),
  ),
)}

The emulated line delays also what never leaves the page, such as the \`blob:\` addresses by which GLTFLoader reads images: one latency more for the other two.

## Aims

${table(["", "scene", "measured", "aim"], aims(rows, scenes, decoders, { median, when, n }))}
`;
}

/** What was aimed at, and what became of it, over Draco's on the first line. */
function aims(rows, scenes, decoders, { median, when, n }) {
  const slow = rows.filter(({ line }) => line === LINES[0]);
  const over = (act) => slow.map(({ scene, told }) => [scene.name, act(told.unweld) / act(told.draco)]);
  const wholes = (list) => median(list.map(({ whole }) => whole)) / 1000;
  const draco = new Map(slow.map(({ scene, told }) => [scene.name, wholes(told.draco.drawn)]));
  const list = [
    ["bytes of the first picture, of Draco's file", scenes.map(({ name, files, first }) => [name, first / files.draco.sent.length]), 0.05],
    ["first picture, of Draco's time to the whole", over(({ drawn }) => when(drawn, () => true)), 0.1],
    ["the same, undrawn", over(({ undrawn }) => when(undrawn, () => true)), 0.1],
    ["30 dB, of Draco's time to the whole", slow.map(({ scene, told }) => [scene.name, when(told.unweld.drawn, ({ psnr }) => psnr >= 30) / draco.get(scene.name)]), 0.4],
    ["whole, of Draco's", over(({ drawn }) => wholes(drawn)), 1.1],
    ["the same, undrawn", over(({ undrawn }) => wholes(undrawn)), 1.1],
    ["longest task, ms, on any line", rows.map(({ scene, line, told }) => [`${scene.name}, ${line.megabits} Mbit/s`, median(told.unweld.drawn.map(({ longest }) => longest))]), 50],
  ];
  const worst = list.map(([what, each, most]) => {
    const [name, value] = each.reduce((a, b) => (b[1] > a[1] ? b : a));
    const reached = each.filter(([, value]) => value <= most).length;
    return [`${what}: ${reached} of ${each.length} reach it, worst`, name, n(value, most < 1 ? 3 : most < 10 ? 2 : 0), `at most ${most}`];
  });
  return [...worst, ["loader and decoder, kB with brotli", "", n(decoders.unweld / 1000, 0), "at most 180"]];
}
