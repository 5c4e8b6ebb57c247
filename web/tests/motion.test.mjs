// Animations whose samples come late: there from the first, and whatever plays them goes on with the samples.

import assert from "node:assert/strict";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { AnimationMixer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const entry = fileURLToPath(new URL("../src/motion.ts", import.meta.url));
const made = await build({ entryPoints: [entry], bundle: true, format: "esm", write: false, external: ["three"] });
const outfile = new URL("./motion.built.mjs", import.meta.url);
const { writeFile, rm } = await import("node:fs/promises");
await writeFile(outfile, made.outputFiles[0].contents);
const { Motion } = await import(outfile).finally(() => rm(outfile));

/** A node that moves from its rest to elsewhere and turns, with the samples in the second buffer. */
const times = [0, 1, 2];
const moves = [1, 2, 3, 4, 2, 3, 9, 2, 3];
const turns = [0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0];
const bytes = new Float32Array([...times, ...moves, ...turns]).buffer;
const document = () => ({
  asset: { version: "2.0" },
  scenes: [{ nodes: [0] }],
  nodes: [{ name: "arm", translation: [5, 6, 7], rotation: [1, 0, 0, 0] }],
  bufferViews: [[0, 12], [12, 36], [48, 48]].map(([byteOffset, byteLength]) => ({ buffer: 1, byteOffset, byteLength })),
  accessors: [["SCALAR", [2]], ["VEC3"], ["VEC4"]].map(([type, max], bufferView) => ({ bufferView, componentType: 5126, count: 3, type, ...(max && { max }) })),
  animations: [
    {
      name: "wave",
      samplers: [{ input: 0, output: 1 }, { input: 0, output: 2 }],
      channels: ["translation", "rotation"].map((path, sampler) => ({ sampler, target: { node: 0, path } })),
    },
  ],
});

/** What GLTFLoader makes of it with a level at which the samples come, of two; `arrive` lets them come. */
async function loaded(level) {
  let arrive;
  const buffer = new Promise((resolve) => (arrive = () => resolve(new Uint8Array(bytes))));
  const events = [];
  const busy = [];
  const scene = {
    contents: { levels: [{}, {}], resources: [{ kind: "scene", level: 1 }, { kind: "buffer", level: 1 }, { kind: "buffer", level }] },
    buffer: () => buffer,
    busy: (work) => busy.push(work),
    dispatchEvent: (event) => events.push(event),
  };
  const loader = new GLTFLoader();
  loader.register((parser) => {
    const motion = new Motion(parser, parser.json, scene);
    const loadBufferView = async (k) => (await buffer).slice(parser.json.bufferViews[k].byteOffset).buffer.slice(0, parser.json.bufferViews[k].byteLength);
    return { name: "late", loadAnimation: (k) => motion.load(k), loadBufferView };
  });
  const parsed = loader.parseAsync(document(), "");
  return { parsed, arrive, events, busy };
}

test("a clip stands still until its samples have come, and then moves what plays it", async () => {
  const { parsed, arrive, events, busy } = await loaded(0);
  const { scene, animations: [clip] } = await parsed;
  assert.deepEqual([clip.name, clip.duration, clip.tracks.length], ["wave", 2, 2]);
  const arm = scene.getObjectByName("arm");
  const mixer = new AnimationMixer(scene);
  const action = mixer.clipAction(clip).play();
  for (const time of [0, 0.5, 1.5]) {
    mixer.setTime(time);
    assert.deepEqual([arm.position.toArray(), arm.quaternion.toArray()], [[5, 6, 7], [1, 0, 0, 0]]);
  }
  arrive();
  await new Promise((resolve) => setTimeout(resolve, 10));
  await Promise.all(busy);
  assert.deepEqual(events, [{ type: "animation", animation: 0 }]);
  for (const [time, x] of [[0, 1], [0.5, 2.5], [1, 4], [1.5, 6.5]]) {
    mixer.setTime(time);
    assert.deepEqual(arm.position.toArray(), [x, 2, 3], `at ${time}`);
  }
  assert.deepEqual(arm.quaternion.toArray().map((x) => Math.round(100 * x)), [0, 71, 71, 0]);
  assert.ok(action.isRunning());
});

test("samples that stand at the base are waited for", async () => {
  const { parsed, arrive, events } = await loaded(1);
  let isThere = false;
  void parsed.then(() => (isThere = true));
  await new Promise((resolve) => setTimeout(resolve, 10));
  assert.equal(isThere, false);
  arrive();
  const { animations: [clip] } = await parsed;
  assert.deepEqual([[...clip.tracks[0].values], events], [moves, []]);
});
