// The geometries of a scene, part by part, against the one geometry of the same file. `node --test web/tests`

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test as run } from "node:test";
import { UnweldScene } from "../dist/gltf.js";
import { UnweldGeometry } from "../dist/three.js";
import { decode, WorkerPool } from "../dist/unweld.js";

const [globe, scene] = (await Promise.all(["globe", "scene"].map((name) => readFile(new URL(`${name}.uwm`, import.meta.url))))).map((bytes) => new Uint8Array(bytes));
const test = (name, act) => run(name, { timeout: 240_000 }, act);
const KIND = (components) => ({ componentType: 5126, type: components === 1 ? "SCALAR" : `VEC${components}` });
const SEMANTICS = { normal: "NORMAL", uv: "TEXCOORD_0", color: "COLOR_0", joints: "JOINTS_0", weights: "WEIGHTS_0" };
const NAMES = { NORMAL: "normal", TEXCOORD_0: "uv", COLOR_0: "color" };

async function* pieces(bytes, size) {
  for (let at = 0; at < bytes.length; at += size) {
    yield bytes.slice(at, at + size);
    await new Promise((resolve) => setTimeout(resolve, 0));
  }
}

/** A document with one primitive a part. */
function documentOf(contents, parts, { exponent, skinned }) {
  const attributes = { POSITION: KIND(3) };
  for (const { semantic, components, domain } of contents.fileAttributes) {
    if (domain === "corner" && NAMES[SEMANTICS[semantic]]) attributes[SEMANTICS[semantic]] = KIND(components);
  }
  const primitives = parts.map((part) => ({ extensions: { UNWELD_progressive_mesh: { part, exponent, attributes } } }));
  return { meshes: [{ primitives }], nodes: skinned ? [{ mesh: 0, skin: 0 }] : [] };
}

/** The triangles of an index by what their corners have, in any order. */
function soup(geometry, { start, count }, scale, like) {
  // Colours that are not born yet are white in a scene, whose materials may want some.
  const names = ["position", ...Object.values(NAMES)].filter((name) => like.attributes[name]);
  const corner = (w) =>
    names.flatMap((name) => {
      const { array, itemSize } = geometry.attributes[name];
      return Array.from({ length: itemSize }, (_, c) => array[itemSize * w + c] * (name === "position" ? scale : 1));
    });
  const index = geometry.index.array;
  return Array.from({ length: count / 3 }, (_, t) => [0, 1, 2].flatMap((c) => corner(index[start + 3 * t + c])).join()).sort();
}

function compare(parts, one, other, exponent, where) {
  const groups = one.groups.length ? one.groups : [{ materialIndex: parts[0], start: 0, count: 3 * one.triangles }];
  for (const group of groups) {
    const geometry = other.geometry(group.materialIndex);
    const range = { start: 0, count: geometry.drawRange.count };
    assert.deepEqual(soup(geometry, range, 2 ** exponent, one), soup(one, group, 1, one), `${where}, part ${group.materialIndex}`);
    assert.equal(geometry.index.count, range.count);
  }
  const told = [...other.parts()].reduce((sum, { drawRange }) => sum + drawRange.count / 3, 0);
  assert.equal(told, one.triangles, where);
}

test("each part has its triangles, at every delta, whatever its exponent and buffers", async () => {
  for (const [bytes, size] of [[globe, 60], [scene, 900]]) {
    const first = decode(bytes, { pool: new WorkerPool(0), prefix: true });
    const names = new Set();
    for await (const { attributes } of first) for (const part of attributes?.values.part ?? []) if (part < 2 ** 32 - 1) names.add(part);
    const parts = [...names];
    for (const exponent of [-2, 3]) {
      const document = documentOf(first.contents, parts, { exponent, skinned: exponent === 3 });
      const settings = { pool: new WorkerPool(0), jumps: true, levels: true };
      const stream = decode(pieces(bytes, size), settings);
      const one = new UnweldGeometry({ relative: false, next: () => new Promise(() => {}), close: () => {} }, { morph: true });
      const other = new UnweldScene(stream, { morph: true, document });
      other.prepare(document);
      other.parts = () => parts.map((part) => other.geometry(part));
      let steps = 0;
      // A part that no triangle has yet is nobody's; before parts are born all are of part 0, which there may be none of.
      const check = (where) => one.groups.length && compare(parts, one, other, exponent, where);
      other.addEventListener("refine", ({ delta }) => {
        one.apply(delta);
        if (steps++ % 5 === 0 || delta.complete) check(`${size}, ${exponent}: delta ${steps}`);
      });
      await other.complete;
      assert.ok(steps > 2);
      check("the end");
      for (const level of [2, 1, null, 0]) {
        await other.show(level);
        check(`level ${level}`);
      }
      // Buffers are shared where attributes agree, and not where there is a skin.
      const positions = new Set(other.parts().map((geometry) => geometry.getAttribute("position")));
      assert.equal(positions.size, exponent === 3 ? parts.length : 1);
      const sum = [...new Set(other.parts().flatMap(({ attributes, index }) => [...Object.values(attributes), index]))].reduce((sum, { array }) => sum + array.byteLength, 0);
      assert.equal(other.bytes, sum);
    }
  }
});

test("a box is of a part's own triangles, and of what may come", async () => {
  const stream = decode(scene, { pool: new WorkerPool(0), resources: true });
  const other = new UnweldScene(stream, {});
  // Without three.js's objects its textures never are there.
  await new Promise((resolve) => other.addEventListener("refine", ({ delta }) => delta.complete && resolve()));
  const document = await other.ready;
  const size = (part) => {
    const { min, max } = other.geometry(part).boundingBox;
    return ["x", "y", "z"].map((axis) => max[axis] - min[axis]);
  };
  // A ball of radius 1, whose positions lie in the file twice as large; a worm of length 4, half as large.
  for (const extent of size(0)) assert.ok(Math.abs(extent - 2) < 0.02);
  assert.ok(Math.abs(size(1)[1] - 4) < 0.02);
  // The target moves each vertex of the bud by half its radius.
  assert.ok(Math.abs(size(2)[0] - 3) < 0.02);
  const bud = other.geometry(2);
  assert.deepEqual([bud.morphAttributes.position.length, bud.morphTargetsRelative], [1, true]);
  const worm = other.geometry(1);
  const { array } = worm.getAttribute("skinWeight");
  for (let w = 0; w < worm.getAttribute("position").count; w++) assert.ok(Math.abs(array[4 * w] + array[4 * w + 1] - 1) < 1e-6);
  assert.equal(document.images[0].mimeType, "image/png");
});

test("resources come once, and only where they are wanted", async () => {
  const came = [];
  for await (const { resources, contents } of decode(scene, { pool: new WorkerPool(0), resources: true })) {
    for (const { kind, number, bytes } of resources) {
      const place = contents.resources.findIndex((resource) => resource.kind === kind) + number;
      came.push([kind, number]);
      if (kind === "buffer") assert.equal(bytes.length, contents.resources[place].bytes);
    }
  }
  assert.deepEqual(came, [["scene", 0], ["buffer", 0], ["buffer", 1], ["buffer", 2], ["buffer", 3]]);
  for await (const { resources } of decode(scene, { pool: new WorkerPool(0) })) assert.deepEqual(resources, []);
});
