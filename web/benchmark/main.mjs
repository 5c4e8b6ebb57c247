// `web/bench`: three.js with the loader of this package and with two others, in Chromium, over lines of certain speeds.

import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, rename, rm, writeFile, mkdir } from "node:fs/promises";
import { loadavg, tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";

const HELP = `Compare UnweldLoader with glTF and Draco, and glTF and meshoptimizer, in three.js in Chromium

Usage: web/bench [OPTIONS] [MESH]...

Arguments:
  [MESH]...           Meshes (PLY, OBJ, STL or OFF, also .gz); where none is given, bunny, igea and the dragon from $UNWELD_DATA
                      or ../shared/data. The last one is drawn in the pictures

Options:
      --runs <N>      Loads of each, of which the median is told [default: 5]
      --cold <N>      Loads of each in a page that has no decoder yet [default: 3]
      --bits <N>      Bits a coordinate [default: 14]
      --cache <DIR>   Where the meshes' files are kept [default: unweld-bench in the folder for temporary files]
      --out <DIR>     Where to write BENCHMARKS.md and pictures/ [default: web]
      --json <FILE>   Where to write all that was measured, as JSON
      --scenes        Measure scenes (.glb, .gltf) instead, with their textures, and write BENCHMARKS-SCENES.md; where none is given, five
                      from $UNWELD_DATA or ../shared/data. $GLTFPACK is the program that packs the third column, $NEEDLE the folder of
                      @needle-tools/gltf-build-pipeline for a fourth one, of bytes
      --quick         Check that it works: a small made mesh, each loaded once; nothing is written
  -h, --help          Print help

It wants Chromium (/usr/bin/chromium or $CHROMIUM), npm ci in web/, and the command line of unweld: $UNWELD, or cargo builds it.

EXAMPLES
  web/bench
  web/bench --runs 3 scan.ply --out /tmp/scan
  web/bench --quick
`;

const MESHES = ["scan_bunny.ply.gz", "bench/igea.ply.gz", "bench/dragon_vrip.ply.gz"];
const SCENES = ["tex_flighthelmet.glb", "scene_saw.glb", "tex_cat_statue.glb", "scene_sheenchair.glb", "tex_waterbottle.glb"].map((name) => `gltf/${name}`);
const KINDS = ["unweld", "draco", "meshopt"];
const LINES = [
  { megabits: 10, latency: 50 },
  { megabits: 100, latency: 10 },
];
/** Milliseconds after which there are pictures. */
const TIMES = [250, 500, 1000, 2000, 4000];
const [WIDTH, HEIGHT] = [300, 230];

const root = fileURLToPath(new URL("../../", import.meta.url));

/** A mistake of the caller. */
class Usage extends Error {}

try {
  process.exitCode = await main();
} catch (error) {
  console.error(error instanceof Usage ? `web/bench: ${error.message}` : error);
  process.exitCode = error instanceof Usage ? 2 : 1;
}

async function main() {
  const { values, positionals } = read();
  if (values.help) return void process.stdout.write(HELP) ?? 0;
  const missing = ["playwright-core", "esbuild", "draco3d"].find((name) => !existsSync(join(root, "web/node_modules", name)));
  if (missing) throw new Usage(`${missing} is not installed: cd web && npm ci`);
  const { chromium } = await import("./browser.mjs");
  if (!chromium) throw new Usage("there is no Chromium at /usr/bin/chromium; $CHROMIUM says where else");
  const unweld = command();
  const begin = performance.now();
  if (values.scenes) {
    const { measureScenes } = await import("./scenes.mjs");
    const text = await measureScenes(positionals.length > 0 ? positionals : usual(SCENES), unweld, { ...values, gltfpack: process.env.GLTFPACK, needle: process.env.NEEDLE });
    await mkdir(values.out, { recursive: true });
    await writeFile(join(values.out, "BENCHMARKS-SCENES.md"), text);
    process.stdout.write(text);
    return 0;
  }
  if (!values.quick) {
    const measured = await measure(positionals.length > 0 ? positionals : usual(), unweld, values);
    measured.seconds = (performance.now() - begin) / 1000;
    return write(measured, values);
  }
  const work = await mkdtemp(join(tmpdir(), "unweld-bench-"));
  try {
    execFileSync(unweld, ["demo", "--once", "--quiet", "--output", work], { stdio: ["ignore", "ignore", "inherit"] });
    const settings = { ...values, runs: 1, cold: 1, cache: work, times: TIMES.slice(0, 2) };
    const { check } = await import("./check.mjs");
    console.log(check(await measure([join(work, "demo.ply")], unweld, settings)));
    return 0;
  } finally {
    await rm(work, { recursive: true, force: true });
  }
}

function read() {
  const text = { type: "string" };
  const options = { runs: text, cold: text, bits: text, cache: text, out: text, json: text };
  const flags = { quick: { type: "boolean" }, scenes: { type: "boolean" }, help: { type: "boolean", short: "h" } };
  let told;
  try {
    told = parseArgs({ options: { ...options, ...flags }, allowPositionals: true });
  } catch (error) {
    throw new Usage(error.message);
  }
  const values = { runs: "5", cold: "3", bits: "14", cache: join(tmpdir(), "unweld-bench"), out: join(root, "web"), ...told.values };
  for (const [name, least, most] of [["runs", 1, 99], ["cold", 1, 99], ["bits", 8, 16]]) {
    const number = Number(values[name]);
    if (!Number.isInteger(number) || number < least || number > most) {
      throw new Usage(`--${name} ${values[name]}: it must be a whole number from ${least} to ${most}`);
    }
    values[name] = number;
  }
  const gone = told.positionals.find((mesh) => !existsSync(mesh));
  if (gone) throw new Usage(`${gone}: there is no such file`);
  return { values, positionals: told.positionals };
}

/** The command line of unweld, built if it is not what its sources make. */
function command() {
  if (process.env.UNWELD) return process.env.UNWELD;
  const build = ["build", "--release", "--locked", "--bin", "unweld", "--message-format", "json-render-diagnostics"];
  const told = execFileSync("cargo", build, { cwd: root, stdio: ["ignore", "pipe", "inherit"], encoding: "utf8" });
  return told.split("\n").filter(Boolean).map((line) => JSON.parse(line).executable).find(Boolean);
}

function usual(names = MESHES) {
  const folder = process.env.UNWELD_DATA ?? join(root, "../shared/data");
  const meshes = names.map((name) => join(folder, name));
  const gone = meshes.find((mesh) => !existsSync(mesh));
  if (gone) throw new Usage(`${gone}: there is no such file; name meshes, or say in $UNWELD_DATA where they are`);
  return meshes;
}

/** All that is measured, for `report` and `check`. */
async function measure(inputs, unweld, { runs, cold, bits, cache, times = TIMES }) {
  const rooms = ["./meshes.mjs", "./site.mjs", "./browser.mjs"];
  const [{ prepare }, { serve }, { Browser }] = await Promise.all(rooms.map((room) => import(room)));
  const load = loadavg()[0];
  const meshes = [];
  for (const input of inputs) {
    say(`making ${input}`);
    meshes.push(await prepare(input, bits, cache, unweld));
  }
  const site = await serve(meshes);
  const browser = await Browser.start(site);
  try {
    const results = [];
    let speeds = null;
    for (const line of LINES) {
      for (const mesh of meshes) {
        const page = await browser.page();
        speeds ??= await browser.speeds(page, LINES[0]);
        const told = Object.fromEntries(KINDS.map((kind) => [kind, { warm: [], cold: [] }]));
        for (const kind of KINDS) await browser.load(page, kind, mesh.files[kind].path, null);
        for (let run = 0; run < runs; run++) {
          say(`${mesh.name}, ${line.megabits} Mbit/s, ${run + 1} of ${runs}`);
          for (const kind of turned(KINDS, run)) told[kind].warm.push(await browser.load(page, kind, mesh.files[kind].path, line));
        }
        await page.page.close();
        for (let run = 0; run < cold; run++) {
          say(`${mesh.name}, ${line.megabits} Mbit/s, without decoders, ${run + 1} of ${cold}`);
          for (const kind of turned(KINDS, run)) {
            told[kind].cold.push(await alone(browser, (page) => browser.load(page, kind, mesh.files[kind].path, line)));
          }
        }
        for (const kind of KINDS) {
          say(`${mesh.name}, ${line.megabits} Mbit/s, watched`);
          told[kind].watched = await alone(browser, async (page) => {
            await page.page.evaluate((kind) => globalThis.stage.loader(kind), kind);
            return browser.watch(page, kind, mesh.files[kind].path, line);
          });
        }
        results.push({ mesh, line, told });
      }
    }
    say("pictures");
    const pictures = await drawn(browser, meshes.at(-1), results, times);
    say("");
    return { meshes, results, pictures, speeds, load, runs, cold, decoders: site.decoders, browser: browser.version() };
  } finally {
    await browser.close();
    site.close();
  }
}

/** In a page of its own. */
async function alone(browser, act) {
  const page = await browser.page();
  try {
    return await act(page);
  } finally {
    await page.page.close();
  }
}

/** What was to be seen when on the first line, and how the error fell. */
async function drawn(browser, mesh, results, times) {
  const rows = [];
  for (const kind of KINDS) {
    const cells = await alone(browser, async (page) => {
      await browser.load(page, kind, mesh.files[kind].path, null);
      await browser.load(page, kind, mesh.files[kind].path, LINES[0], times);
      await page.page.evaluate(() => globalThis.setDrawing(true));
      const cells = [];
      for (const number of times.keys()) {
        cells.push(await page.page.evaluate(([number, ...size]) => globalThis.stage.draw(number, ...size), [number, WIDTH, HEIGHT]));
      }
      return cells;
    });
    rows.push({ kind, cells });
  }
  const { pictures } = await import("./report.mjs");
  return alone(browser, ({ page }) => pictures(page, { mesh, rows, times, size: [WIDTH, HEIGHT], results }));
}

function turned(list, by) {
  return list.map((_, k) => list[(k + by) % list.length]);
}

/** Progress on one line, where someone looks. */
function say(text) {
  if (process.stderr.isTTY) process.stderr.write(`\r\x1b[K${text}`);
}

async function write(measured, { out, json }) {
  const { report } = await import("./report.mjs");
  await mkdir(join(out, "pictures"), { recursive: true });
  const whole = async (path, content) => {
    await writeFile(`${path}.new`, content);
    await rename(`${path}.new`, path);
  };
  const text = report(measured);
  await whole(join(out, "BENCHMARKS.md"), text);
  for (const [name, bytes] of Object.entries(measured.pictures.files)) await whole(join(out, "pictures", name), bytes);
  if (json) await whole(json, JSON.stringify(measured, (key, value) => (["files", "bytes", "sent"].includes(key) ? undefined : value), 1));
  process.stdout.write(text);
  return 0;
}
