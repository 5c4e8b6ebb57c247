// `web/bench --scenes`: whole scenes with their textures, as .uwm, as glTF with Draco, as gltfpack packs them; bytes, first picture, 30 dB, all.

import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdir, readFile, writeFile } from "node:fs/promises";
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

/** The report, as Markdown, of scenes (.glb or .gltf). `gltfpack`: its program, or none, and then that column is left out. */
export async function measureScenes(inputs, unweld, { cache, runs, gltfpack }) {
  const load = loadavg()[0];
  const kinds = KINDS.filter((kind) => kind !== "meshopt" || gltfpack);
  const scenes = [];
  for (const input of inputs) scenes.push(await prepared(input, unweld, cache, gltfpack));
  const site = await serve(scenes);
  const browser = await Browser.start(site);
  const rows = [];
  try {
    for (const line of LINES) {
      for (const scene of scenes) {
        const told = Object.fromEntries(kinds.map((kind) => [kind, []]));
        for (let run = 0; run < runs; run++) {
          for (let k = 0; k < kinds.length; k++) {
            const kind = kinds[(k + run) % kinds.length];
            told[kind].push(await browser.scene(kind, scene.files[kind].path, line));
          }
        }
        rows.push({ line, scene, told });
      }
    }
    return report({ rows, scenes, kinds, load, runs, decoders: site.decoders, browser: browser.version() });
  } finally {
    await browser.close();
    site.close();
  }
}

async function prepared(input, unweld, cache, gltfpack) {
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
    const packed = brotliCompressSync(bytes, { params: { [constants.BROTLI_PARAM_QUALITY]: 9 } });
    const pays = kind !== "unweld" && packed.length < 0.98 * bytes.length;
    files[kind] = { path: `${name}/${basename(path)}`, bytes, sent: pays ? packed : bytes, encoding: pays ? "br" : null };
  }
  // Header, table, base, and what stands right behind it: document, small previews, what animations are made of.
  const stream = decode(files.unweld.bytes, { pool: new WorkerPool(0), resources: true });
  const { levels } = await stream.peek();
  stream.close();
  return { name, files, first: levels.at(-1).end };
}

function report({ rows, scenes, kinds, load, runs, decoders, browser }) {
  const median = (list) => [...list].sort((a, b) => a - b)[Math.floor(list.length / 2)];
  const when = (list, is) => median(list.map(({ pictures }) => pictures.find(is)?.time ?? NaN)) / 1000;
  const n = (x, digits = 2) => (Number.isFinite(x) ? x.toFixed(digits) : "–");
  const count = (x) => Math.round(x).toLocaleString("en");
  const table = (head, lines) => [head, head.map(() => "---"), ...lines].map((cells) => `| ${cells.join(" | ")} |`).join("\n");
  return `# Scenes in the browser

- Chromium ${browser}, drawing in software; load average at the start ${load.toFixed(1)}${load > 1 ? ": the machine had other work to do, and times are the longer for it" : ""}
- Medians of ${runs}; \`web/bench --scenes\`; Draco at level 10, its files and those of gltfpack -cc sent with brotli where that is less

Loader and decoder with brotli, GLTFLoader not counted: ${Object.entries(decoders).map(([kind, bytes]) => `${kind} ${count(bytes)}`).join(", ")} bytes.

## Bytes

${table(
  ["scene", ...kinds, "unweld/Draco", "first picture", "of Draco's file"],
  scenes.map(({ name, files, first }) => {
    const draco = files.draco.sent.length;
    return [name, ...kinds.map((kind) => count(files[kind].sent.length)), n(files.unweld.sent.length / draco), count(first), n(first / draco, 3)];
  }),
)}

## Seconds from load()

First picture with textures; as near to the last as 30 dB; all there; the longest task of the page's thread in milliseconds, drawing left out.

${table(
  ["line", "scene", "loader", "first", "30 dB", "whole", "longest task"],
  rows.flatMap(({ line, scene, told }) =>
    kinds.map((kind) => [
      ...[`${line.megabits} Mbit/s`, scene.name, kind, n(when(told[kind], () => true)), n(when(told[kind], ({ psnr }) => psnr >= 30))],
      ...[n(median(told[kind].map(({ whole }) => whole)) / 1000), n(median(told[kind].map(({ longest }) => longest)), 0)],
    ]),
  ),
)}
`;
}
