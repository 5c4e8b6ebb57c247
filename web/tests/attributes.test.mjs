// Attributes in Node.js: what is told of them, and what becomes of a geometry. `node --test web/tests`
// `tests/client.rs` makes the files: a globe of radius 1, a little uneven, dressed, with a triangle that is there twice, and an icosahedron.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test as run } from "node:test";
import { decode, WorkerPool } from "../dist/unweld.js";
import { Mirror } from "./mirror.mjs";

const read = async (path) => new Uint8Array(await readFile(new URL(path, import.meta.url)));
const [globe, facets, sphere] = await Promise.all(["globe.uwm", "facets.uwm", "../../tests/golden/sphere.uwm"].map(read));
const pool = new WorkerPool(0);
const test = (name, act) => run(name, { timeout: 60_000 }, act);

async function* pieces(bytes, size) {
  for (let at = 0; at < bytes.length; at += size) {
    yield bytes.slice(at, at + size);
    await new Promise((resolve) => setTimeout(resolve, 0));
  }
}

/** The mesh, and all attributes that were told on the way. */
async function followed(input, options = {}) {
  const [mirror, told, stream] = [new Mirror(), [], decode(input, { pool, ...options })];
  for await (const delta of stream) {
    mirror.apply(delta);
    if (delta.attributes) told.push(delta.attributes);
  }
  return { mirror, told, stream };
}

const corner = (array, at, size) => [...array.subarray(size * at, size * (at + 1))];

/** What the globe has at each corner follows from where that is. */
function checkGlobe({ position, indices: triangles }, { vertices, indices, values }) {
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

test("attributes are told once, however the file arrives", async () => {
  for (const input of [globe, pieces(globe, 1), pieces(globe, 100)]) {
    const { mirror, told } = await followed(input);
    assert.equal(told.length, 1);
    const { vertices, indices, values } = told[0];
    assert.equal(indices.length, 3 * mirror.triangles);
    assert.ok(vertices.length > mirror.vertices, "there is a seam");
    const types = Object.entries(values).map(([name, array]) => [name, array.constructor.name]);
    assert.deepEqual(types, [["uv", "Float32Array"], ["normal", "Float32Array"], ["color", "Uint8Array"], ["part", "Uint32Array"]]);
    assert.ok(checkGlobe(mirror, told[0]) > 0, "the seam is a border of the texture");
    assert.deepEqual([2, 5].map((part) => mirror.last.metadata.partNames[part]), ["below", "above"]);
    const entries = mirror.last.contents.fileAttributes.map(({ name, domain, components, type, normalised, partial }) => [name, domain, components, type, normalised, partial]);
    assert.deepEqual(entries, [
      ["uv", "corner", 2, "f32", false, false],
      ["normal", "corner", 3, "f32", false, false],
      ["color", "corner", 3, "u8", true, true],
      ["part", "triangle", 1, "u32", false, false],
    ]);
  }
});

test("a coarser level has none, and level 0 has them again", async () => {
  const { mirror, told, stream } = await followed(globe, { levels: true });
  const coarse = await stream.show(2);
  assert.equal(coarse.attributes, null);
  mirror.apply(coarse);
  const back = await stream.show(null);
  mirror.apply(back);
  assert.deepEqual(back.attributes, told[0]);
  stream.close();
});

test("a file without attributes is what it was", async () => {
  const { mirror, told } = await followed(pieces(sphere, 100));
  assert.deepEqual([told, mirror.last.contents.fileAttributes], [[], []]);
  assert.deepEqual(mirror.last.contents.attributes.map(({ name }) => name), ["position", "normal"]);
});

test("a stream that is left before they arrive tells none", async () => {
  const { mirror, told } = await followed(globe, { until: { level: 1 } });
  assert.deepEqual([told, mirror.last.complete], [[], true]);
  const controller = new AbortController();
  const aborted = followed(pieces(globe, 50), { signal: controller.signal });
  setTimeout(() => controller.abort(), 5);
  await assert.rejects(aborted, { name: "AbortError" });
});

test("an array that is handed on is whole", async () => {
  const { told } = await followed(facets);
  const { normal } = told[0].values;
  assert.deepEqual([normal.byteOffset, normal.byteLength], [0, normal.buffer.byteLength]);
  assert.equal(told[0].vertices.length, 60, "each face has wedges of its own");
});
