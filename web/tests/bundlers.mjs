// The packed package as an application has it: installed from the tarball, put together by bundlers, run in Chromium. In each of them both entries
// have one three.js, the worker starts, finds the module, and decodes.
// `node tests/bundlers.mjs PACKAGE.tgz`

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { ARGUMENTS, chromium } from "./chromium.mjs";
import { serve } from "./server.mjs";

const { chromium: browserType } = await import("playwright-core");
const local = (path) => fileURLToPath(new URL(path, import.meta.url));
const [tarball] = process.argv.slice(2).map((path) => resolve(path));
const work = await mkdtemp(join(tmpdir(), "unweld-bundlers-"));
const app = join(work, "app");
const browser = await browserType.launch({ executablePath: chromium, args: ARGUMENTS });

const PAGE = `<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><script type="module" src="SCRIPT"></script>`;
const MAIN = `
import { BufferGeometry, Object3D } from "three";
import { decode } from "unweld";
import { UnweldGLTFLoader } from "unweld/gltf";
import { UnweldLoader } from "unweld/three";

const run = async () => {
  let last;
  for await (const delta of decode(new URL("/mesh.uwm", location.href))) last = delta;
  const geometry = await new UnweldLoader().loadAsync("/mesh.uwm");
  await geometry.complete;
  const { scene, unweld } = await new UnweldGLTFLoader().loadAsync("/scene.uwm");
  await unweld.complete;
  const isOne = geometry instanceof BufferGeometry && scene instanceof Object3D;
  return { triangles: last.triangles, drawn: geometry.drawRange.count / 3, inScene: unweld.triangles, isOne };
};
run().then((told) => (globalThis.told = told), (error) => (globalThis.told = { error: String(error) }));
`;

try {
  await installed();
  for (const name of ["vite5", "vite7", "vite"]) {
    const vite = await import(name);
    await check(`vite ${vite.version} dev`, () => viteServer(vite));
    await check(`vite ${vite.version} build`, () => viteBuild(vite, name));
  }
  await check("webpack", webpackBuild);
  await check("esbuild", esbuildBuild);
} finally {
  await browser.close();
  await rm(work, { recursive: true, force: true });
}

/** An application with nothing but three.js and the tarball. */
async function installed() {
  await mkdir(join(app, "public"), { recursive: true });
  const three = join(app, "node_modules/three");
  await cp(local("../node_modules/three/build"), join(three, "build"), { recursive: true });
  await cp(local("../node_modules/three/package.json"), join(three, "package.json"));
  for (const folder of ["loaders", "utils"]) {
    await cp(local(`../node_modules/three/examples/jsm/${folder}`), join(three, "examples/jsm", folder), { recursive: true });
  }
  await cp(local("../../tests/golden/sphere.uwm"), join(app, "public/mesh.uwm"));
  await cp(local("scene.uwm"), join(app, "public/scene.uwm"));
  const { version } = JSON.parse(await readFile(join(three, "package.json"), "utf8"));
  const dependencies = { three: version };
  await writeFile(join(app, "package.json"), JSON.stringify({ name: "app", private: true, type: "module", dependencies }));
  execFileSync("npm", ["install", "--offline", "--no-audit", "--no-fund", "--silent", tarball], { cwd: app, stdio: ["ignore", "ignore", "inherit"] });
  await writeFile(join(app, "index.html"), PAGE.replace("SCRIPT", "/main.js"));
  await writeFile(join(app, "main.js"), MAIN);
}

/** Loads what a bundler has made, and sees that it works. `make` tells the page's address and how to end its server. */
async function check(what, make) {
  const begin = performance.now();
  const { url, close } = await make();
  const page = await browser.newPage();
  const faults = [];
  page.on("console", (said) => said.type() === "error" && faults.push(said.text()));
  try {
    await page.goto(url);
    await page.waitForFunction(() => globalThis.told, null, { timeout: 60_000 });
    const told = await page.evaluate(() => globalThis.told);
    assert.deepEqual(told, { triangles: 80, drawn: 80, inScene: 2880, isOne: true }, what);
    assert.ok(page.workers().length > 0, `${what}: it is decoded in a worker`);
    assert.deepEqual(faults, [], what);
  } finally {
    await page.close();
    await close();
  }
  console.log(`${what}: ${((performance.now() - begin) / 1000).toFixed(1)} s`);
}

async function viteServer({ createServer }) {
  await rm(join(app, "node_modules/.vite"), { recursive: true, force: true });
  const server = await createServer({ root: app, configFile: false, logLevel: "error", server: { port: 0, host: "127.0.0.1" } });
  await server.listen();
  return { url: `http://127.0.0.1:${server.httpServer.address().port}/`, close: () => server.close() };
}

async function viteBuild({ build }, name) {
  const outDir = join(work, name);
  const warnings = [];
  const customLogger = { info() {}, warn: (text) => warnings.push(text), warnOnce: (text) => warnings.push(text), error: (text) => warnings.push(text) };
  Object.assign(customLogger, { clearScreen() {}, hasErrorLogged: () => false, hasWarned: false });
  await build({ root: app, configFile: false, customLogger, build: { outDir, emptyOutDir: true, chunkSizeWarningLimit: 10_000 } });
  assert.deepEqual(warnings, []);
  return folder(outDir);
}

async function webpackBuild() {
  const webpack = createRequire(import.meta.url)("webpack");
  const out = join(work, "webpack");
  const stats = await new Promise((resolve, reject) =>
    webpack(
      {
        mode: "production",
        context: app,
        entry: "./main.js",
        output: { path: out, filename: "main.js" },
        performance: { hints: false },
        // It takes long, and esbuild has minified the package.
        optimization: { minimize: false },
      },
      (error, stats) => (error ? reject(error) : resolve(stats)),
    ),
  );
  const { errors, warnings } = stats.toJson({ all: false, errors: true, warnings: true });
  assert.deepEqual([...errors, ...warnings].map(({ message }) => message), []);
  await writeFile(join(out, "index.html"), PAGE.replace("SCRIPT", "main.js"));
  return folder(out);
}

/** As README.md says: worker and module are put beside the script. */
async function esbuildBuild() {
  const { build } = await import("esbuild");
  const out = join(work, "esbuild");
  const { warnings } = await build({
    absWorkingDir: app,
    entryPoints: { main: "./main.js", worker: "unweld/worker" },
    bundle: true,
    format: "esm",
    outdir: out,
    logLevel: "silent",
  });
  assert.deepEqual(warnings, []);
  await cp(join(app, "node_modules/unweld/dist/unweld.wasm"), join(out, "unweld.wasm"));
  await writeFile(join(out, "index.html"), PAGE.replace("SCRIPT", "main.js"));
  return folder(out);
}

async function folder(path) {
  const file = async (name) => ({ bytes: await readFile(join(app, "public", name)), etag: '"1"' });
  return serve({ "/mesh.uwm": await file("mesh.uwm"), "/scene.uwm": await file("scene.uwm") }, path);
}
