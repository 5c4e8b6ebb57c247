// What is loaded: one mesh as .uwm, as glTF with Draco, as glTF with meshoptimizer's compression, all made of the same triangles.

import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdir, readFile, rename, stat, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { brotliCompressSync } from "node:zlib";
import { Document, Logger, NodeIO } from "@gltf-transform/core";
import { EXTMeshoptCompression, KHRDracoMeshCompression } from "@gltf-transform/extensions";
import { quantize, reorder } from "@gltf-transform/functions";
import draco3d from "draco3d";
import { MeshoptEncoder } from "meshoptimizer";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";

/** The files of a mesh, by kind of loader. */
const FILES = { unweld: "unweld.uwm", draco: "draco.glb", meshopt: "meshopt.glb" };

/**
 * Makes the files of `mesh` in `folder`/NAME, unless they are there and newer than what they are made of; `unweld` is the command.
 * Returns `{ name, bits, vertices, triangles, diagonal, files: { unweld, draco, meshopt } }`, each file as `{ bytes, sent, encoding }`:
 * `bytes` is its size, `sent` what a server sends of it, with brotli where that is less.
 */
export async function prepare(mesh, bits, folder, unweld) {
  const name = basename(mesh).replace(/(\.(ply|obj|off|stl|gz))+$/i, "");
  const place = join(folder, `${name}-${bits}`);
  const facts = join(place, "facts.json");
  const sources = [mesh, unweld, fileURLToPath(import.meta.url), fileURLToPath(new URL("../package-lock.json", import.meta.url))];
  if (!(await isNewer(facts, sources))) {
    await mkdir(place, { recursive: true });
    await make(mesh, bits, place, unweld, facts);
  }
  const files = {};
  for (const [kind, file] of Object.entries(FILES)) {
    const bytes = await readFile(join(place, file));
    const packed = await readFile(join(place, `${file}.br`));
    // A file that is dense already is sent as it is.
    const pays = packed.length < 0.98 * bytes.length;
    files[kind] = { path: `${name}/${file}`, bytes, sent: pays ? packed : bytes, encoding: pays ? "br" : null };
  }
  return { name, bits, ...JSON.parse(await readFile(facts, "utf8")), files };
}

async function make(mesh, bits, place, unweld, facts) {
  const run = promisify(execFile);
  const [whole, plain, welded] = ["whole.uwm", "whole.ply", "welded.ply"].map((file) => join(place, file));
  // unweld reads what PLYLoader does not (strips, gzip), and writes plain triangles.
  await run(unweld, ["encode", "--quiet", "--exact", mesh, "-o", whole]);
  await run(unweld, ["decode", "--quiet", whole, "-o", plain]);
  const surface = weld(await readFile(plain));
  await writeFile(welded, ply(surface));
  await run(unweld, ["encode", "--quiet", "--position-bits", String(bits), welded, "-o", join(place, FILES.unweld)]);
  await writeFile(join(place, FILES.draco), await draco(surface, bits));
  await writeFile(join(place, FILES.meshopt), await meshopt(surface, bits));
  for (const file of Object.values(FILES)) {
    await writeFile(join(place, `${file}.br`), brotliCompressSync(await readFile(join(place, file))));
  }
  const [vertices, triangles] = [surface.positions.length / 3, surface.indices.length / 3];
  await writeFile(`${facts}.new`, JSON.stringify({ vertices, triangles, diagonal: diagonalOf(surface.positions) }));
  await rename(`${facts}.new`, facts);
}

/** Equal positions become one vertex; triangles without area by their indices and vertices without triangles go. */
function weld(bytes) {
  const geometry = new PLYLoader().parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
  const [from, corners] = [geometry.attributes.position.array, geometry.index.array];
  const numbers = new Map();
  const [positions, indices] = [[], []];
  const numberOf = (v) => {
    const [x, y, z] = [from[3 * v], from[3 * v + 1], from[3 * v + 2]];
    const key = `${x},${y},${z}`;
    let number = numbers.get(key);
    if (number === undefined) {
      numbers.set(key, (number = numbers.size));
      positions.push(x, y, z);
    }
    return number;
  };
  const same = (a, b) => [0, 1, 2].every((k) => from[3 * a + k] === from[3 * b + k]);
  for (let at = 0; at < corners.length; at += 3) {
    const [a, b, c] = [corners[at], corners[at + 1], corners[at + 2]];
    if (!same(a, b) && !same(b, c) && !same(c, a)) indices.push(numberOf(a), numberOf(b), numberOf(c));
  }
  return { positions: Float32Array.from(positions), indices: Uint32Array.from(indices) };
}

function ply({ positions, indices }) {
  const [vertices, triangles] = [positions.length / 3, indices.length / 3];
  const head =
    `ply\nformat binary_little_endian 1.0\nelement vertex ${vertices}\nproperty float x\nproperty float y\nproperty float z\n` +
    `element face ${triangles}\nproperty list uchar uint vertex_indices\nend_header\n`;
  const body = Buffer.alloc(12 * vertices + 13 * triangles);
  positions.forEach((x, k) => body.writeFloatLE(x, 4 * k));
  for (let t = 0; t < triangles; t++) {
    const at = 12 * vertices + 13 * t;
    body[at] = 3;
    for (let k = 0; k < 3; k++) body.writeUInt32LE(indices[3 * t + k], at + 1 + 4 * k);
  }
  return Buffer.concat([Buffer.from(head), body]);
}

/** The best that Draco can do: level 10, which is speed 0. */
async function draco(surface, bits) {
  const document = documentOf(surface);
  const options = { method: KHRDracoMeshCompression.EncoderMethod.EDGEBREAKER, encodeSpeed: 0, decodeSpeed: 0 };
  document
    .createExtension(KHRDracoMeshCompression)
    .setRequired(true)
    .setEncoderOptions({ ...options, quantizationBits: { POSITION: bits } });
  const io = new NodeIO().registerExtensions([KHRDracoMeshCompression]);
  return io.registerDependencies({ "draco3d.encoder": await draco3d.createEncoderModule() }).writeBinary(document);
}

/** In the order that compresses best. */
async function meshopt(surface, bits) {
  const document = documentOf(surface);
  await MeshoptEncoder.ready;
  await document.transform(reorder({ encoder: MeshoptEncoder, target: "size" }), quantize({ quantizePosition: bits }));
  document
    .createExtension(EXTMeshoptCompression)
    .setRequired(true)
    .setEncoderOptions({ method: EXTMeshoptCompression.EncoderMethod.QUANTIZE });
  const used = document.getRoot().listExtensionsUsed();
  const io = new NodeIO().registerExtensions(used.map((extension) => extension.constructor));
  return io.registerDependencies({ "meshopt.encoder": MeshoptEncoder }).writeBinary(document);
}

function documentOf({ positions, indices }) {
  const document = new Document().setLogger(new Logger(Logger.Verbosity.SILENT));
  const buffer = document.createBuffer();
  const accessor = (type, array) => document.createAccessor().setBuffer(buffer).setType(type).setArray(array);
  const primitive = document.createPrimitive().setIndices(accessor("SCALAR", indices));
  primitive.setAttribute("POSITION", accessor("VEC3", positions));
  const node = document.createNode().setMesh(document.createMesh().addPrimitive(primitive));
  document.createScene().addChild(node);
  return document;
}

function diagonalOf(positions) {
  const [least, most] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  positions.forEach((x, at) => {
    least[at % 3] = Math.min(least[at % 3], x);
    most[at % 3] = Math.max(most[at % 3], x);
  });
  return Math.hypot(...most.map((x, k) => x - least[k]));
}

async function isNewer(file, sources) {
  if (!existsSync(file)) return false;
  const [made, ...changed] = await Promise.all([file, ...sources].map(async (path) => (await stat(path)).mtimeMs));
  return changed.every((time) => time < made);
}
