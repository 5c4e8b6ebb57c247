// The geometry and the loader for three.js, in Node.js without a picture. `node --test web/tests`

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test as run } from "node:test";
import { build } from "esbuild";
import { Box3, LoadingManager, Mesh, Vector3 } from "three";
import { UnweldEdges, UnweldGeometry, UnweldLoader, UnweldPlanner } from "../dist/three.js";
import { decode, WorkerPool } from "../dist/unweld.js";
import { Mirror } from "./mirror.mjs";
import { serve } from "./server.mjs";

const sphere = new Uint8Array(await readFile(new URL("../../tests/golden/sphere.uwm", import.meta.url)));
const [globe, facets] = (await Promise.all(["globe", "facets"].map((name) => readFile(new URL(`${name}.uwm`, import.meta.url))))).map((bytes) => new Uint8Array(bytes));
const test = (name, act) => run(name, { timeout: 60_000 }, act);
const stream = (input = sphere, options = {}) => decode(input, { pool: new WorkerPool(0), ...options });

async function* pieces(bytes, size) {
  for (let at = 0; at < bytes.length; at += size) {
    yield bytes.slice(at, at + size);
    await new Promise((resolve) => setTimeout(resolve, 0));
  }
}

/** A stream whose mesh lies elsewhere, so that a vertex at the origin is a foreign one. */
function moved(inner, by) {
  const shift = (values) => values.map((x) => x + by);
  const all = (corner) => corner.map((x) => x + by);
  return {
    relative: false,
    close: () => inner.close(),
    next: async () => {
      const { done, value } = await inner.next();
      if (done) return { done };
      const contents = { ...value.contents, min: all(value.contents.min), max: all(value.contents.max) };
      const appended = { ...value.appended, position: shift(value.appended.position) };
      const { vertices, values } = value.changed.position;
      const changed = { ...value.changed, position: { vertices, values: shift(values) } };
      return { done, value: { ...value, contents, appended, changed } };
    },
  };
}

test("what has arrived is all that is counted, at every step", async () => {
  const geometry = new UnweldGeometry(moved(stream(pieces(sphere, 1)), 10));
  const edges = new UnweldEdges(geometry);
  const [mirror, mesh] = [new Mirror(), new Mesh(geometry)];
  let [steps, roomy] = [0, 0];
  geometry.addEventListener("refine", ({ delta }) => {
    mirror.apply(delta);
    if (!delta.level) return;
    steps++;
    if (geometry.getAttribute("position").array.length > 3 * delta.vertices) roomy++;
    // The box of the mirror's vertices, worked out here.
    const corners = Array.from({ length: mirror.vertices }, (_, v) => new Vector3(...mirror.position.subarray(3 * v, 3 * v + 3)));
    const box = new Box3().setFromPoints(corners);
    const given = geometry.boundingBox;
    geometry.computeBoundingBox();
    geometry.computeBoundingSphere();
    assert.ok(geometry.boundingBox.equals(box), `${steps}: ${JSON.stringify(geometry.boundingBox)}`);
    assert.ok(new Box3().setFromObject(mesh, true).equals(box), "vertex by vertex");
    // An icosphere of radius 1 about (10, 10, 10), 17.3 from the origin: its box has half a diagonal of 1.73.
    assert.ok(geometry.boundingSphere.radius < 1.75 && geometry.boundingSphere.center.x > 9, `${geometry.boundingSphere.radius}`);
    assert.ok(given.min.x > 8.9);
    const counts = ["position", "normal"].map((name) => geometry.getAttribute(name).count);
    assert.deepEqual([...counts, geometry.index.count, geometry.drawRange.count], [delta.vertices, delta.vertices, 3 * delta.triangles, 3 * delta.triangles]);
    assert.equal(geometry.clone().getAttribute("position").count, delta.vertices);
  });
  geometry.addEventListener("refine", ({ delta }) => assert.equal(edges.index.count, 6 * delta.triangles));
  await geometry.complete;
  assert.ok(steps > 12 && roomy > 0, "there is room that is not counted");
});

/** A geometry has at each corner what was told, and triangles part by part. */
function checkDressed(geometry, edges, mirror) {
  const { alive, vertices } = mirror.dress ?? { alive: [], vertices: [] };
  const files = geometry.contents.fileAttributes.filter(({ name }) => alive.includes(name));
  const count = vertices.length || mirror.vertices;
  const used = ["position", "from", "born", "normal", ...files.filter(({ domain }) => domain === "corner").map(({ name }) => name)];
  assert.deepEqual(Object.keys(geometry.attributes).sort(), [...new Set(used)].sort());
  for (const name of used) assert.equal(geometry.getAttribute(name).count, count, name);
  assert.deepEqual([geometry.index.count, geometry.drawRange.count, edges.index.count], [3, 3, 6].map((k) => k * mirror.triangles));
  const part = alive.includes("part") ? mirror.dress.values.part : null;
  const order = [...Array(mirror.triangles).keys()];
  if (part) order.sort((s, t) => part[s] - part[t] || s - t);
  let next = 0;
  for (const { start, count, materialIndex } of geometry.groups) {
    assert.equal(start, next);
    next += count;
    assert.ok(order.slice(start / 3, next / 3).every((t) => part[t] === materialIndex));
  }
  if (part) assert.equal(next, 3 * mirror.triangles);
  else assert.equal(geometry.groups.length, 0);
  const index = geometry.index.array;
  const at = (name, item) => {
    const { array, itemSize } = geometry.getAttribute(name);
    return [...array.subarray(itemSize * item, itemSize * (item + 1))];
  };
  order.forEach((t, k) => {
    for (let c = 0; c < 3; c++) {
      const [wedge, v] = [index[3 * k + c], mirror.indices[3 * t + c]];
      if (vertices.length) assert.equal(wedge, mirror.dress.indices[3 * t + c]);
      else assert.equal(wedge, v);
      const told = [...at("position", wedge), ...files.flatMap(({ name, domain }) => (domain === "corner" ? at(name, wedge) : [part[t]]))];
      assert.deepEqual(told, mirror.corner(t, c));
      if (!alive.includes("normal")) assert.deepEqual(at("normal", wedge), [...mirror.normal.subarray(3 * v, 3 * v + 3)]);
    }
    assert.deepEqual([0, 2, 4].map((c) => edges.index.array[6 * k + c]), [...index.subarray(3 * k, 3 * k + 3)]);
  });
}

test("at every delta a geometry has at each corner what the file has; its buffers are made anew only where attributes are born", async () => {
  for (const size of [1, 50, globe.length]) {
    const geometry = new UnweldGeometry(stream(pieces(globe, size), { levels: true }), { morph: true });
    const [edges, mirror] = [new UnweldEdges(geometry), new Mirror()];
    let [released, births, grown, early] = [0, 0, 0, 0];
    geometry.addEventListener("dispose", () => released++);
    geometry.addEventListener("refine", ({ delta }) => {
      mirror.apply(delta);
      if (delta.attributes?.firstTriangle === 0) births++;
      else if (delta.attributes) grown++;
      if (!delta.level) return;
      checkDressed(geometry, edges, mirror);
      assert.equal(geometry.dressed, mirror.dress !== null);
      assert.equal(edges.getAttribute("position"), geometry.getAttribute("position"));
      if (geometry.dressed && geometry.finest > 0) early++;
      // Who is new sets out where its vertex does.
      const { vertices } = mirror.dress ?? { vertices: [] };
      const from = geometry.getAttribute("from");
      if (delta.firstVertex > 0) {
        vertices.forEach((v, wedge) => {
          const place = 3 * (v - delta.firstVertex);
          if (place >= 0) assert.deepEqual([...from.array.subarray(3 * wedge, 3 * wedge + 3)], [...delta.from.subarray(place, place + 3)]);
        });
      }
    });
    await geometry.complete;
    assert.ok(mirror.dress.vertices.length > geometry.vertices);
    assert.deepEqual([geometry.getAttribute("uv").itemSize, geometry.getAttribute("color").normalized, geometry.getAttribute("color").array.constructor], [2, true, Uint8Array]);
    assert.ok(geometry.getAttribute("color").getX(1) <= 1, "colours are fractions");
    assert.deepEqual([geometry.getAttribute("part"), geometry.flat], [undefined, false]);
    assert.deepEqual(geometry.groups.map(({ materialIndex }) => materialIndex), [2, 5]);
    if (size === 1) assert.ok(early >= 4 && grown >= 4, "attributes are there before level 0, and grow");
    // What is given back: at most twice a birth, by wedge and by vertex.
    assert.ok(released <= 2 * births, `${released} for ${births}`);
    for (const level of [2, 0, geometry.contents.levels.length - 1, null]) await geometry.show(level);
    assert.ok(births >= 5, "every level shown again was checked");
    geometry.dispose();
  }
});

test("a geometry is flat where each triangle has one normal", async () => {
  const flat = new UnweldGeometry(stream(facets));
  await flat.complete;
  assert.deepEqual([flat.flat, flat.getAttribute("position").count, flat.groups], [true, 60, []]);
  const bare = new UnweldGeometry(stream());
  await bare.complete;
  assert.deepEqual([bare.flat, bare.dressed, bare.getAttribute("position").count], [false, false, 42]);
});

test("a geometry that is disposed of before all is there was never complete", async () => {
  const half = new UnweldGeometry(stream(pieces(sphere, 10)));
  const told = [];
  for (const type of ["complete", "error"]) half.addEventListener(type, ({ error }) => told.push([type, error?.name]));
  half.addEventListener("refine", ({ delta }) => delta.level && half.dispose());
  await assert.rejects(half.complete, { name: "AbortError" });
  assert.deepEqual(told, [["error", "AbortError"]]);
  assert.equal(half.last.complete, false);

  const unasked = new UnweldGeometry(stream(sphere, { keep: true }), { waits: true });
  unasked.dispose();
  await assert.rejects(unasked.complete, { name: "AbortError" });

  const whole = new UnweldGeometry(stream());
  whole.addEventListener("complete", () => told.push(["complete"]));
  await whole.complete;
  whole.dispose();
  await whole.complete;
  assert.deepEqual(told.at(-1), ["complete"]);
});

test("a prefix completes a geometry, and says that it is one", async () => {
  const { value } = await stream().next();
  const geometry = new UnweldGeometry(stream(sphere.slice(0, value.contents.levels[3].end), { prefix: true }));
  await geometry.complete;
  assert.deepEqual([geometry.finest, geometry.last.prefix, geometry.triangles], [3, true, value.contents.levels[3].triangles]);
});

test("the loading manager hears of the first picture, events tell the rest", async () => {
  globalThis.document ??= { baseURI: "http://127.0.0.1/" };
  const { value } = await stream().next();
  const base = value.contents.levels.at(-1).end;
  const server = await serve({ "/breaks.uwm": { bytes: sphere, etag: '"1"', breakAfter: base + 40 }, "/whole.uwm": { bytes: sphere, etag: '"1"' } });
  try {
    const told = [];
    const manager = new LoadingManager(() => told.push("all"), undefined, (url) => told.push(`no ${new URL(url).pathname}`));
    const loader = new UnweldLoader(manager).setWorkerLimit(0);
    loader.retries = 0;
    const changed = [];
    loader.onChange = (geometry) => changed.push(geometry.triangles);
    const geometry = await loader.loadAsync(`${server.url}/breaks.uwm`);
    assert.deepEqual(told, ["all"], "the manager waits no longer");
    assert.ok(geometry.triangles < 80);
    const broken = new Promise((resolve) => geometry.addEventListener("error", ({ error }) => resolve(error)));
    const end = await geometry.complete.catch((error) => error);
    assert.deepEqual([end.name, (await broken).name, told], ["ConnectionError", "ConnectionError", ["all"]]);

    let refined = 0;
    changed.length = told.length = 0;
    await new Promise((resolve, reject) => {
      const loaded = (geometry) => {
        refined++;
        geometry.addEventListener("refine", () => refined++);
        geometry.addEventListener("complete", resolve);
      };
      loader.load(`${server.url}/whole.uwm`, loaded, undefined, reject);
    });
    assert.deepEqual([changed.at(-1), told], [80, ["all"]]);
    assert.ok(refined > 0 && changed.length >= refined, "each change is told");

    const error = await loader.loadAsync(`${server.url}/gone.uwm`).catch((error) => error);
    assert.equal(error.status, 404);
    await new Promise((resolve) => setTimeout(resolve, 0));
    assert.deepEqual(told, ["all", "no /gone.uwm", "all"]);
  } finally {
    server.close();
  }
});

test("a slower line lets through all bytes, in small pieces; none is in the way where it is off", async () => {
  const entry = new URL("../src/viewer/line.ts", import.meta.url).pathname;
  const { outputFiles } = await build({ entryPoints: [entry], write: false, bundle: true, format: "esm" });
  const { lineOf } = await import(`data:text/javascript,${encodeURIComponent(outputFiles[0].text)}`);
  const bytes = Uint8Array.from({ length: 30_000 }, (_, k) => k * k);
  const { fetch } = globalThis;
  const answers = [];
  globalThis.fetch = async () => (answers.push(new Response(bytes, { status: 206, headers: { etag: '"1"' } })), answers.at(-1));
  try {
    let speed = 2;
    const line = lineOf(() => speed);
    const [answer, other] = [await line(""), await line("")];
    assert.deepEqual([answer.status, answer.headers.get("etag")], [206, '"1"']);
    // 2 Mbit/s are 5,000 bytes in 20 ms.
    for (const { body } of [answer, other]) {
      const pieces = [];
      for await (const piece of body) pieces.push(piece);
      assert.deepEqual(pieces.map(({ length }) => length), [5000, 5000, 5000, 5000, 5000, 5000]);
      assert.deepEqual(new Uint8Array(Buffer.concat(pieces)), bytes);
    }
    speed = 0;
    assert.equal(await line(""), answers[2]);
  } finally {
    globalThis.fetch = fetch;
  }
});

test("a planner's rule that does not exist is refused", () => {
  assert.throws(() => new UnweldPlanner({ pixel: 1 }), /^TypeError: UnweldPlanner has no "pixel": only pixels, budget, measure, slack, lanes, segment$/);
});
