// What must be true of measurements however fast the machine is.

import assert from "node:assert/strict";
import { report, timesOf } from "./report.mjs";

/** Throws where something is wrong; returns a line that says what is right. */
export function check(measured) {
  const { meshes, results, pictures, speeds } = measured;
  for (const { mesh, line, told } of results) {
    for (const [kind, { warm, cold, watched }] of Object.entries(told)) {
      const where = `${kind} at ${line.megabits} Mbit/s`;
      for (const { triangles, moments } of [...warm, ...cold, watched]) {
        assert.equal(triangles, mesh.triangles, `${where}: triangles`);
        assert.equal(moments.at(-1).triangles, mesh.triangles, `${where}: triangles in the last picture`);
        assert.ok(moments.every(({ time, applied }) => time >= applied), `${where}: nothing is seen before it is there`);
      }
      const { first, max1, max01, whole } = timesOf(warm, mesh.diagonal);
      assert.ok(0 < first && first <= max1 && max1 <= max01 && max01 <= whole, `${where}: ${first} ${max1} ${max01} ${whole}`);
      const bits = 8 * mesh.files[kind].sent.length;
      assert.ok(whole / 1000 > (0.8 * bits) / 1e6 / line.megabits, `${where}: no faster than the line`);
      assert.ok(watched.tasks.length > 0 && watched.heap > 0, `${where}: tasks and heap`);
    }
    const { moments } = told.unweld.warm[0];
    assert.ok(moments[0].bytes < mesh.files.unweld.bytes.length / 2, "unweld shows something before half of the file is there");
  }
  for (const speed of speeds) assert.ok((8 * speed) / 1e6 < 1.2 * results[0].line.megabits, "pages and workers are bound by the line");
  for (const picture of Object.values(pictures.files)) assert.equal(picture.subarray(1, 4).toString(), "PNG");
  const text = report({ ...measured, seconds: 0 });
  assert.ok(!/NaN|undefined|Infinity/.test(text), text);
  const bytes = Object.entries(meshes[0].files).map(([kind, { sent }]) => `${kind} ${sent.length}`);
  return `${meshes[0].name}: ${meshes[0].triangles} triangles with each of three loaders; bytes: ${bytes.join(", ")}`;
}
