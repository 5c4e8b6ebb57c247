// Attributes in Node.js: what is told of them, and what becomes of a geometry. `node --test web/tests`
// `tests/client.rs` makes the files: a globe of radius 1, a little uneven, dressed, with a triangle that is there twice, and an icosahedron.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test as run } from "node:test";
import { decode, WorkerPool } from "../dist/unweld.js";
import { Mirror } from "./mirror.mjs";

const read = async (path) => new Uint8Array(await readFile(new URL(path, import.meta.url)));
const digests = JSON.parse(await readFile(new URL("globe.json", import.meta.url), "utf8"));
const [globe, facets, sphere] = await Promise.all(["globe.uwm", "facets.uwm", "../../tests/golden/sphere.uwm"].map(read));
const pool = new WorkerPool(0);
const test = (name, act) => run(name, { timeout: 60_000 }, act);

async function* pieces(bytes, size) {
  for (let at = 0; at < bytes.length; at += size) {
    yield bytes.slice(at, at + size);
    await new Promise((resolve) => setTimeout(resolve, 0));
  }
}

/** The mesh, and all attributes that were told on the way, `look` being called for each delta. */
async function followed(input, options = {}, look = () => {}) {
  const [mirror, told, stream] = [new Mirror(), [], decode(input, { pool, ...options })];
  for await (const delta of stream) {
    mirror.apply(delta);
    if (delta.attributes) told.push(delta.attributes);
    look(mirror, delta);
  }
  return { mirror, told, stream };
}

const corner = (array, at, size) => [...array.subarray(size * at, size * (at + 1))];

/** What the globe has at each corner follows from where that is. */
function checkGlobe({ position, indices: triangles, dress: { vertices, indices, values: lists } }) {
  const values = Object.fromEntries(Object.entries(lists).map(([name, list]) => [name, Float64Array.from(list)]));
  const colorless = [];
  let seam = 0;
  for (let t = 0; 3 * t < indices.length; t++) {
    const heights = [];
    for (let k = 0; k < 3; k++) {
      const wedge = indices[3 * t + k];
      const p = corner(position, vertices[wedge], 3);
      assert.deepEqual(p, corner(position, triangles[3 * t + k], 3), "a wedge lies where the triangle's vertex does");
      const [u, v] = corner(values.uv, wedge, 2);
      const way = p[0] / (Math.abs(p[0]) + Math.abs(p[1])) / 4;
      const turn = p[1] >= 0 ? 0.5 + way : -way;
      const apart = u - turn - Math.round(u - turn);
      // Where x is 0 and y is not above it, the turn jumps, and quantised coordinates are on either side; at the poles there is none.
      if (Math.hypot(p[0], p[1]) > 0.1) assert.ok(Math.abs(apart) < 2e-3, `${u} is not ${turn}`);
      if (u < -1e-3) seam++;
      assert.ok(Math.abs(v - p[2]) < 2e-3);
      const normal = corner(values.normal, wedge, 3);
      normal.forEach((x, k) => assert.ok(Math.abs(x - p[k] / Math.hypot(...p)) < 5e-3));
      const color = corner(values.color, wedge, 3);
      if (color.every((x) => x === 0)) colorless.push(t);
      else color.forEach((x, k) => assert.ok(Math.abs(x - 127.5 - 127.5 * p[k]) < 2));
      heights.push(p[2]);
    }
    // On the lattice, a vertex of the equator may be on its other side.
    if (heights.every((z) => Math.abs(z) > 1e-3)) assert.equal(values.part[t], heights.every((z) => z > 0) ? 5 : 2);
  }
  assert.ok(colorless.length > 0 && colorless.length < indices.length / 6, "some triangles have no colour");
  return seam;
}

test("at each level, each corner has what the program's decoder says, however the file arrives", async () => {
  for (const size of [globe.length, 1, 20, 300]) {
    const [seen, firsts] = [new Map(), []];
    const { mirror, told } = await followed(pieces(globe, size), {}, (mirror, delta) => {
      if (delta.attributes) firsts.push(delta.attributes.firstTriangle);
      // Byte by byte a level's own state is seen, from its last vertex to the first that moves.
      const { level } = delta;
      const stays = delta.levels.includes(level) || delta.changed.position.vertices.length === 0;
      if (size === 1 && level?.vertices === mirror.vertices && stays) seen.set(level.level, mirror.dressed());
    });
    seen.set(0, mirror.dressed());
    if (size === 1) assert.deepEqual([...seen.keys()].sort((a, b) => a - b), [...digests.keys()], "all levels were seen");
    for (const [level, digest] of seen) assert.equal(digest, digests[level], `level ${level}, pieces of ${size}`);
    if (size === 1) assert.ok(firsts.filter((first) => first > 0).length >= 4, "most of it is appended");
    const { vertices, values } = mirror.dress;
    assert.ok(vertices.length > mirror.vertices, "there is a seam");
    const types = Object.entries(told[0].values).map(([name, array]) => [name, array.constructor.name]);
    assert.deepEqual(types, [["uv", "Float32Array"], ["normal", "Float32Array"], ["color", "Uint8Array"], ["part", "Uint32Array"]].filter(([name]) => name in told[0].values));
    assert.deepEqual(Object.keys(values), ["uv", "normal", "color", "part"]);
    assert.ok(checkGlobe(mirror) > 0, "the seam is a border of the texture");
    assert.deepEqual([2, 5].map((part) => mirror.last.metadata.partNames[part]), ["below", "above"]);
    for (const { level, attributeErrors } of mirror.last.contents.levels) {
      const alive = mirror.last.contents.fileAttributes.filter((attribute) => level > 0 && attribute.level >= level).map(({ name }) => name);
      assert.deepEqual(attributeErrors.map(({ name }) => name), alive, `errors of level ${level}`);
      for (const { name, error, high } of attributeErrors) assert.ok(error >= 0 && (name === "part" ? high === null : high >= 0));
    }
    const entries = mirror.last.contents.fileAttributes.map(({ name, domain, components, type, normalised, partial }) => [name, domain, components, type, normalised, partial]);
    assert.deepEqual(entries, [
      ["uv", "corner", 2, "f32", false, false],
      ["normal", "corner", 3, "f32", false, false],
      ["color", "corner", 3, "u8", true, true],
      ["part", "triangle", 1, "u32", false, false],
    ]);
  }
});

test("a coarser level shown again has its own, and level 0 what it had", async () => {
  const { mirror, stream } = await followed(globe, { levels: true });
  for (const level of [2, 1, digests.length - 1, 3, null]) {
    const delta = await stream.show(level);
    mirror.apply(delta);
    assert.equal(mirror.dressed(), digests[level ?? 0], `level ${level}`);
    assert.equal(delta.attributes?.firstTriangle ?? 0, 0);
  }
  stream.close();
});

test("a file without attributes is what it was", async () => {
  const { mirror, told } = await followed(pieces(sphere, 100));
  assert.deepEqual([told, mirror.last.contents.fileAttributes], [[], []]);
  assert.deepEqual(mirror.last.contents.attributes.map(({ name }) => name), ["position", "normal"]);
});

test("a stream that is left at a coarse level has what is alive there", async () => {
  const { mirror } = await followed(globe, { until: { level: 1 } });
  assert.deepEqual([mirror.dressed(), mirror.last.complete], [digests[1], true]);
  const controller = new AbortController();
  const aborted = followed(pieces(globe, 50), { signal: controller.signal });
  setTimeout(() => controller.abort(), 5);
  await assert.rejects(aborted, { name: "AbortError" });
});

test("an array that is handed on is whole", async () => {
  const { told, mirror } = await followed(facets);
  const { normal } = told.at(-1).values;
  assert.deepEqual([normal.byteOffset, normal.byteLength], [0, normal.buffer.byteLength]);
  assert.equal(mirror.dress.vertices.length, 60, "each face has wedges of its own");
});
