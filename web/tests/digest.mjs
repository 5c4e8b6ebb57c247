// Decodes files with the WebAssembly module, or the one in $UNWELD_WASM, and prints what web/wasm/examples/digest.rs prints, with its own time.

import { readFile } from "node:fs/promises";
import { basename } from "node:path";
import { pathToFileURL } from "node:url";
import { decode, WorkerPool } from "../dist/unweld.js";
import { Mirror } from "./mirror.mjs";

const pool = new WorkerPool(0);
const { UNWELD_WASM } = process.env;
const settings = { pool, ...(UNWELD_WASM && { wasm: pathToFileURL(UNWELD_WASM) }) };
for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(await readFile(path));
  const deltas = [];
  const begin = performance.now();
  for await (const delta of decode(bytes, settings)) deltas.push(delta);
  const time = Math.round(performance.now() - begin);
  const mirror = new Mirror();
  for (const delta of deltas) mirror.apply(delta);
  const { residue } = mirror.last;
  const plain = !residue || !Object.values(residue).some((count) => count > 0);
  const words = [basename(path), mirror.triangles, mirror.sum(), plain ? mirror.exact() : "-", `${time} ms,`, mirror.vertices];
  console.log(words.join(" "), "vertices");
}
