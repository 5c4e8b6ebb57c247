// Scenes in three.js in Chromium: there after the first kilobytes, refined in place, textures too; animated meanwhile; the glTF extension; the viewer.
// `node tests/scenes.mjs [FOLDER FOR PICTURES]`

import assert from "node:assert/strict";
import { mkdir, mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { Document, NodeIO } from "@gltf-transform/core";
import { build } from "esbuild";
import { UnweldProgressiveMesh } from "../dist/transform.js";
import { decode, WorkerPool } from "../dist/unweld.js";
import { ARGUMENTS, chromium } from "./chromium.mjs";
import { serve } from "./server.mjs";

const { chromium: browserType } = await import("playwright-core").catch(() => ({}));
if (!chromium || !browserType) {
  console.log(`skipped: ${chromium ? "playwright-core is not installed (cd web && npm ci)" : "there is no Chromium"}`);
  process.exit(process.env.CI === "true" ? 1 : 0);
}

const local = (path) => fileURLToPath(new URL(path, import.meta.url));
const [pictures] = process.argv.slice(2);
const bytes = await readFile(local("scene.uwm"));
const HEAD = `<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">
<script type="importmap">{ "imports": { "three": "/page/three.js", "three/addons/loaders/GLTFLoader.js": "/page/loader.js",
  "unweld": "/unweld.js", "unweld/gltf": "/gltf.js", "unweld/three": "/three.js" } }</script>`;

/** The page's own libraries: three.js in one file, its loader in another. */
async function libraries() {
  const outside = { name: "three", setup: (build) => build.onResolve({ filter: /^three$/ }, () => ({ path: "three", external: true })) };
  const made = await build({
    stdin: { contents: 'export * from "three/addons/loaders/GLTFLoader.js";', resolveDir: local("..") },
    ...{ bundle: true, format: "esm", write: false, plugins: [outside] },
  });
  const three = await build({ stdin: { contents: 'export * from "three";', resolveDir: local("..") }, bundle: true, format: "esm", write: false });
  return { "/page/three.js": three.outputFiles[0].contents, "/page/loader.js": made.outputFiles[0].contents };
}

/** An ordinary glTF of the ball alone: its base as accessors, and the .uwm at an address or within. */
async function extended(inside) {
  const until = { level: Infinity };
  let base;
  for await (const delta of decode(new Uint8Array(bytes), { pool: new WorkerPool(0), until })) if (delta.attributes) base = delta;
  const { indices, values, vertices } = base.attributes;
  const document = new Document();
  const extension = document.createExtension(UnweldProgressiveMesh);
  const buffer = document.createBuffer();
  const of = (type, array) => document.createAccessor().setBuffer(buffer).setType(type).setArray(array);
  const triangles = [...values.part].flatMap((part, t) => (part === 0 ? [...indices.subarray(3 * t, 3 * t + 3)] : []));
  const position = Float32Array.from([...vertices].flatMap((v) => [...base.appended.position.subarray(3 * v, 3 * v + 3)].map((x) => x / 2)));
  const primitive = document.createPrimitive().setIndices(of("SCALAR", Uint16Array.from(triangles))).setAttribute("POSITION", of("VEC3", position));
  primitive.setAttribute("NORMAL", of("VEC3", values.normal));
  const kind = { componentType: 5126, type: "VEC3" };
  primitive.setExtension("UNWELD_progressive_mesh", extension.createPart().setPart(0).setExponent(1).setAttributes({ POSITION: kind, NORMAL: kind }));
  document.createScene().addChild(document.createNode().setMesh(document.createMesh().addPrimitive(primitive)));
  const mesh = extension.createMesh();
  document.getRoot().setExtension("UNWELD_progressive_mesh", inside ? mesh.setBytes(new Uint8Array(bytes)) : mesh.setURI("slow.uwm"));
  const io = new NodeIO().registerExtensions([UnweldProgressiveMesh]);
  const glb = await io.writeBinary(document);
  // What is written is read.
  const again = await io.readBinary(glb);
  const read = again.getRoot().getExtension("UNWELD_progressive_mesh");
  assert.deepEqual([read.getURI(), read.getBytes()?.length], inside ? ["", bytes.length] : ["slow.uwm", undefined]);
  const [part] = again.getRoot().listMeshes()[0].listPrimitives();
  assert.equal(part.getExtension("UNWELD_progressive_mesh").getExponent(), 1);
  return Buffer.from(glb);
}

// The image takes most of the bytes; what comes before it takes two seconds.
const rate = Math.round(bytes.length / 16);
const files = {
  "/page.html": { bytes: Buffer.from(HEAD), headers: { "content-type": "text/html" } },
  "/slow.uwm": { bytes, etag: '"1"', rate },
  "/quick.uwm": { bytes, etag: '"1"' },
  "/small.uwm": { bytes, etag: '"1"', rate: 16 * rate },
  "/cut.uwm": { bytes: bytes.subarray(0, 60), etag: '"1"' },
  "/outside.glb": { bytes: await extended(false), etag: '"1"' },
  "/inside.glb": { bytes: await extended(true), etag: '"1"' },
};
for (const [path, script] of Object.entries(await libraries())) files[path] = { bytes: Buffer.from(script), headers: { "content-type": "text/javascript" } };
const server = await serve(files, local("../dist"));
const profile = await mkdtemp(join(tmpdir(), "unweld-scenes-"));
const context = await browserType.launchPersistentContext(profile, { executablePath: chromium, viewport: { width: 640, height: 480 }, args: ARGUMENTS });

try {
  if (pictures) await mkdir(pictures, { recursive: true });
  const page = await context.newPage();
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (told) => ["error", "warning"].includes(told.type()) && !/GPU stall|GL Driver/.test(told.text()) && faults.push(told.text()));
  await page.goto(`${server.url}/page.html`);

  // A stage, and what tests ask of it.
  await page.evaluate(async () => {
    const three = await import("three");
    const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
    const gltf = await import("unweld/gltf");
    const renderer = new three.WebGLRenderer({ preserveDrawingBuffer: true });
    renderer.setSize(600, 400);
    document.body.append(renderer.domElement);
    const camera = new three.PerspectiveCamera(40, 1.5, 0.1, 100);
    camera.position.set(0, 0, 24);
    const stage = { three, GLTFLoader, ...gltf, renderer, camera };
    stage.draw = (root) => {
      const scene = new three.Scene();
      scene.background = new three.Color(0, 0, 0);
      scene.add(new three.HemisphereLight(0xffffff, 0x404040, 3), root);
      renderer.render(scene, camera);
      scene.remove(root);
    };
    /** The colour in the picture where a point of the scene is. */
    stage.pixel = (x, y) => {
      const gl = renderer.getContext();
      const p = new three.Vector3(x, y, 0).project(camera);
      const out = new Uint8Array(4);
      gl.readPixels(Math.round((p.x / 2 + 0.5) * gl.drawingBufferWidth), Math.round((p.y / 2 + 0.5) * gl.drawingBufferHeight), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, out);
      return [...out.subarray(0, 3)];
    };
    globalThis.stage = stage;
  });

  const seen = await page.evaluate(async () => {
    const { three, UnweldGLTFLoader, draw, pixel } = globalThis.stage;
    const loader = new UnweldGLTFLoader();
    loader.morph = loader.levels = true;
    let changes = 0;
    loader.onChange = () => changes++;
    const gltf = await loader.loadAsync("/slow.uwm");
    const { scene, animations, unweld, parser } = gltf;
    const early = { level: unweld.finest, bytes: unweld.last.bytes, triangles: unweld.triangles, changes };
    const by = (name) => scene.getObjectByName(name);
    draw(scene);
    [early.ball, early.beside] = [pixel(-5, 4), pixel(5, 1.3)];
    const [ball, mirrored, worm, bud] = ["ball", "mirrored", "worm", "bud"].map(by);
    const mixer = new three.AnimationMixer(scene);
    mixer.clipAction(three.AnimationClip.findByName(animations, "bend")).play();
    mixer.clipAction(three.AnimationClip.findByName(animations, "bulge")).play();
    // Animated while it refines: a picture with each delta.
    let pictures = 0;
    const reach = [];
    const colours = [];
    unweld.addEventListener("refine", () => {
      mixer.setTime(0.999);
      unweld.slide.time.value = unweld.clock();
      draw(scene);
      pictures++;
      reach.push(pixel(5, 1.3)[2]);
    });
    unweld.addEventListener("texture", ({ size }) => {
      draw(scene);
      colours.push([size, pixel(-5, 4)]);
    });
    await unweld.complete;
    mixer.setTime(0.999);
    unweld.slide.time.value = unweld.clock() + 10;
    draw(scene);
    const late = { level: unweld.finest, ball: pixel(-5, 4), triangles: unweld.triangles };
    const size = (geometry) => {
      geometry.computeBoundingBox();
      return geometry.boundingBox.getSize(new three.Vector3()).toArray();
    };
    const extents = [ball, worm, bud].map(({ geometry }) => size(geometry));
    const counts = [ball, worm, bud].map(({ geometry }) => geometry.drawRange.count / 3);
    await unweld.show(unweld.contents.levels.length - 1);
    const coarse = ball.geometry.drawRange.count / 3;
    await unweld.show(null);
    return {
      early, late, pictures, reach, colours, extents, counts, coarse,
      again: ball.geometry.drawRange.count / 3,
      shared: ball.geometry === mirrored.geometry,
      kinds: [worm.isSkinnedMesh, bud.morphTargetInfluences?.length, Object.keys(worm.geometry.attributes).sort()],
      bent: new three.Box3().setFromObject(worm, true).min.x,
      extras: scene.userData, names: animations.map(({ name }) => name), generator: gltf.asset.generator, isParser: typeof parser.getDependency,
      cameras: gltf.cameras.length, ids: [scene === gltf.scenes[0]],
    };
  });
  console.log(JSON.stringify(seen));
  if (pictures) await page.screenshot({ path: join(pictures, "scene.png") });
  const { early, late } = seen;
  assert.ok(early.bytes < bytes.length / 2 && early.level > 0, `the scene was there after ${early.bytes} of ${bytes.length} bytes`);
  assert.ok(late.level === 0 && late.triangles > early.triangles && seen.pictures > 3);
  assert.ok(early.ball[0] > 150 && early.ball[1] < 60, `the smallest preview is red: ${early.ball}`);
  assert.ok(late.ball[1] > 120 && late.ball[0] < 60, `the image is green: ${late.ball}`);
  assert.deepEqual(seen.colours.map(([size]) => size), [16, 150], "previews give way to what is finer");
  assert.deepEqual(seen.counts, [1280, 1280, 320], "icospheres of three and two subdivisions");
  assert.ok(seen.coarse < 1280 && seen.again === 1280);
  // The shapes as their glTF has them, not as they lie in the file.
  const [ball, worm, bud] = seen.extents;
  for (const x of ball) assert.ok(Math.abs(x - 2) < 0.02, `the ball has radius 1: ${ball}`);
  assert.ok(Math.abs(worm[1] - 4) < 0.02 && Math.abs(worm[0] - 0.5) < 0.02, `the worm is 4 long: ${worm}`);
  assert.ok(bud[0] > 2.9 && bud[0] < 3.1, `the bud's box has room for its target: ${bud}`);
  assert.ok(seen.bent < -1.2, `bent by 90 degrees the tip is at the left: ${seen.bent}`);
  assert.deepEqual(early.beside, [0, 0, 0]);
  assert.ok(seen.reach.at(-1) > 60, `the bud bulges out to where nothing was: ${seen.reach}`);
  assert.deepEqual([seen.shared, ...seen.kinds.slice(0, 2)], [true, true, 1]);
  assert.deepEqual(seen.kinds[2], ["born", "from", "normal", "position", "skinIndex", "skinWeight"]);
  assert.deepEqual([seen.extras.kept, seen.names, seen.generator, seen.isParser], [true, ["bend", "bulge"], "by hand", "function"]);

  // Previews are enough: the image is not fetched, until it is wanted.
  const small = await page.evaluate(async () => {
    const { UnweldGLTFLoader, draw, pixel } = globalThis.stage;
    const loader = new UnweldGLTFLoader();
    Object.assign(loader, { until: { textures: 16 }, keep: true });
    const { scene, unweld } = await loader.loadAsync("/small.uwm");
    await unweld.complete;
    draw(scene);
    const before = { ball: pixel(-5, 4), level: unweld.finest };
    await unweld.want({});
    draw(scene);
    const after = pixel(-5, 4);
    unweld.dispose();
    return { before, after };
  });
  assert.ok(small.before.level === 0 && small.before.ball[0] > 150 && small.before.ball[1] > 80, `orange: ${small.before.ball}`);
  assert.ok(small.after[1] > 120 && small.after[0] < 60, `green when it is wanted: ${small.after}`);
  const asked = server.requests.filter(({ path }) => path === "/small.uwm").map(({ headers }) => headers.range ?? "");
  assert.ok(asked.length >= 3 && asked[0] === "", `it jumped, then fetched the image: ${asked}`);

  // Errors: a file that ends early, one that is no scene, one that is abandoned.
  const errors = await page.evaluate(async () => {
    const { UnweldGLTFLoader } = globalThis.stage;
    const told = async (url, act = () => {}) => {
      const loader = new UnweldGLTFLoader();
      loader.retries = 0;
      const loaded = loader.loadAsync(url);
      act(loader);
      return loaded.then(() => "loaded", (error) => `${error.name}: ${error.message}`);
    };
    return [await told("/cut.uwm"), await told("/none.uwm"), await told("/slow.uwm", (loader) => loader.abort())];
  });
  assert.match(errors[0], /ConnectionError|FormatError/);
  assert.match(errors[1], /HttpError.*404/);
  assert.match(errors[2], /AbortError/);

  // The extension in ordinary glTF: GLTFLoader shows the accessors at once, then the rest.
  for (const file of ["/outside.glb", "/inside.glb"]) {
    const told = await page.evaluate(async (file) => {
      const { three, GLTFLoader, UnweldExtension, draw } = globalThis.stage;
      const loader = new GLTFLoader();
      const plain = await loader.loadAsync(file);
      loader.register((parser) => new UnweldExtension(parser));
      const { scene, unweld } = await loader.loadAsync(file);
      const mesh = scene.getObjectByProperty("isMesh", true);
      const count = ({ geometry }) => Math.min(geometry.drawRange.count, geometry.index.count) / 3;
      draw(scene);
      const before = count(mesh);
      await unweld.complete;
      draw(scene);
      const size = new three.Box3().setFromObject(scene, true).getSize(new three.Vector3()).x;
      return { base: count(plain.scene.getObjectByProperty("isMesh", true)), before, after: count(mesh), size };
    }, file);
    assert.ok(told.base > 0 && told.base < 1280 && (told.before < 1280 || file === "/inside.glb"), `${file}: ${JSON.stringify(told)}`);
    assert.equal(told.after, 1280);
    assert.ok(Math.abs(told.size - 2) < 0.02);
  }
  assert.deepEqual(faults.filter((fault) => !/404/.test(fault)), []);

  // The viewer.
  const viewer = await context.newPage();
  const others = [];
  viewer.on("pageerror", (error) => others.push(String(error)));
  viewer.on("console", (told) => told.type() === "error" && others.push(told.text()));
  await viewer.goto(`${server.url}/index.html?src=slow.uwm`);
  await viewer.waitForFunction(() => globalThis.unweld.triangles > 0);
  await viewer.waitForFunction(() => globalThis.unweld.complete && globalThis.unweld.textures === 2, null, { timeout: 60_000 });
  assert.deepEqual(await viewer.$$eval("#clip option", (options) => options.map(({ text }) => text)), ["still", "bend", "bulge"]);
  const drawn = await viewer.evaluate(() => globalThis.unweld.drawn.count);
  await viewer.selectOption("#clip", { label: "bend" });
  await viewer.waitForFunction((drawn) => globalThis.unweld.drawn.count > drawn + 3, drawn);
  if (pictures) await viewer.screenshot({ path: join(pictures, "viewer.png") });
  await viewer.fill("#level", "0");
  await viewer.waitForFunction(() => !document.getElementById("levelName").textContent.endsWith(" 0"));
  assert.deepEqual(others, []);
  console.log("a scene refines in place; previews give way to images; the extension shows its accessors first");
} finally {
  await context.close();
  server.close();
  await rm(profile, { recursive: true, force: true });
}
