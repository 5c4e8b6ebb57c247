// The package in Node.js: deltas, faults, connections that break. `node --test web/tests`

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test as run } from "node:test";
import { ConnectionError, decode, FormatError, HttpError, WorkerPool } from "../dist/unweld.js";
import { Mirror } from "./mirror.mjs";
import { serve } from "./server.mjs";

const golden = (name) => readFile(new URL(`../../tests/golden/${name}.uwm`, import.meta.url));
const [sphere, torus, order] = (await Promise.all([golden("sphere"), golden("torus"), golden("order")])).map((bytes) => new Uint8Array(bytes));
const pool = new WorkerPool(0);
const test = (name, act) => run(name, { timeout: 60_000 }, act);

async function mirrorOf(input, options = {}) {
  const mirror = new Mirror();
  for await (const delta of decode(input, { pool, ...options })) mirror.apply(delta);
  return mirror;
}

/** Bytes of the sphere that leave some of it out. */
const most = (await mirrorOf(sphere)).last.contents.levels[1].end;
/** Bytes of the sphere to the end of its base. */
const base = (await mirrorOf(sphere)).last.contents.levels.at(-1).end;
/** Bytes of the sphere without its keyframes. */
const { end } = (await mirrorOf(sphere)).last.contents.wanted;

async function* pieces(bytes, size) {
  for (let at = 0; at < bytes.length; at += size) {
    yield bytes.slice(at, at + size);
    await new Promise((resolve) => setTimeout(resolve, 0));
  }
}

async function within(files, act) {
  const server = await serve(files);
  try {
    return await act(server);
  } finally {
    server.close();
  }
}

test("an icosphere of 80 triangles arrives whole, with all levels in order", async () => {
  const mirror = await mirrorOf(sphere);
  assert.deepEqual([mirror.vertices, mirror.triangles], [42, 80]);
  const { contents, complete, bytes } = mirror.last;
  assert.equal(complete, true);
  assert.equal(bytes, contents.wanted.end);
  const count = contents.levels.length;
  assert.deepEqual(mirror.levels.map(({ level }) => level), Array.from({ length: count }, (_, k) => count - 1 - k));
  assert.match(mirror.last.metadata.generator, /unweld/);
});

test("members of a set take each other's place", async () => {
  const triangles = [81, 40, 20, 15];
  for (const [name, arrived] of [["set", [3, 2, 1, 0]], ["small_set", [0]]]) {
    const bytes = new Uint8Array(await golden(name));
    const [mirror, stream] = [new Mirror(), decode(bytes, { pool, levels: true })];
    for await (const delta of stream) mirror.apply(delta);
    const { contents, complete } = mirror.last;
    assert.deepEqual([contents.set, complete, mirror.last.bytes], [true, true, bytes.length], name);
    assert.deepEqual(mirror.levels.map(({ level }) => level), arrived);
    assert.deepEqual(contents.levels.map((level) => level.triangles), [80, 40, 20, 15], "the residue has one more");
    const finest = [mirror.triangles, mirror.sum(), mirror.dress.alive];
    for (const number of [2, 1, 3]) {
      mirror.apply(await stream.show(number));
      assert.deepEqual([mirror.triangles, mirror.dress, mirror.last.level.level], [triangles[number], null, number]);
    }
    mirror.apply(await stream.show(null));
    assert.deepEqual([mirror.triangles, mirror.sum(), mirror.dress.alive], finest);
    stream.close();
    const coarse = await mirrorOf(bytes, { until: { triangles: 30 } });
    assert.deepEqual([coarse.triangles, coarse.last.bytes], [20, contents.levels[2].end]);
    await assert.rejects(mirrorOf(bytes.subarray(0, bytes.length - 1), { levels: true }), /the file is cut off in member/);
  }
  const prefix = await mirrorOf(new Uint8Array(await golden("set")).subarray(0, 1000), { prefix: true });
  assert.deepEqual([prefix.last.prefix, prefix.last.complete, prefix.last.level.level > 0], [true, false, true]);
});

test("level 0 is all, by whichever word it is wanted", async () => {
  for (const bytes of [sphere, order]) {
    const whole = await mirrorOf(bytes);
    const { levels, wanted } = whole.last.contents;
    assert.equal(levels[0].end, wanted.end);
    for (const until of [{ level: 0 }, { error: 0 }, { error: 0, measure: "rms" }]) {
      // Without the keyframes too, as a server's `refine` gives it.
      for (const input of [bytes, bytes.slice(0, wanted.end)]) {
        const mirror = await mirrorOf(input, { until });
        assert.deepEqual([mirror.last.complete, mirror.last.bytes, mirror.exact()], [true, wanted.end, whole.exact()]);
        assert.deepEqual([mirror.last.residue, mirror.last.metadata], [whole.last.residue, whole.last.metadata]);
      }
    }
  }
});

test("the size of the pieces does not matter", async () => {
  for (const bytes of [sphere, torus]) {
    const whole = await mirrorOf(bytes);
    for (const size of [1, 7, 100]) {
      const mirror = await mirrorOf(pieces(bytes, size));
      assert.deepEqual([mirror.triangles, mirror.exact()], [whole.triangles, whole.exact()]);
      assert.deepEqual(mirror.normal.subarray(0, 3 * mirror.vertices), whole.normal.subarray(0, 3 * whole.vertices));
    }
  }
});

test("normals are those of the triangles at every delta", async () => {
  const mirror = new Mirror();
  let deltas = 0;
  for await (const delta of decode(pieces(sphere, 1), { pool })) {
    mirror.apply(delta);
    deltas++;
    const anew = mirror.normalsAnew();
    for (let v = 0; v < mirror.vertices; v++) {
      const [n, m] = [mirror.normal, anew].map((array) => array.subarray(3 * v, 3 * v + 3));
      const length = Math.hypot(...m);
      for (let k = 0; k < 3; k++) assert.ok(Math.abs(n[k] - m[k] / length) < 1e-4, `vertex ${v} of ${mirror.vertices}`);
    }
  }
  assert.ok(deltas > 12, "one for each level at least");
});

test("new vertices come from the middle of two others, where these are by then", async () => {
  const mirror = new Mirror();
  let seen = 0;
  for await (const delta of decode(pieces(sphere, 1), { pool })) {
    mirror.apply(delta);
    if (delta.firstVertex === 0 || delta.vertices !== delta.firstVertex + 1) continue;
    const old = Array.from({ length: delta.firstVertex }, (_, v) => [...mirror.position.subarray(3 * v, 3 * v + 3)]);
    const near = (a, b) => a.every((x, k) => Math.abs(x - b[k]) < 1e-5);
    const middles = old.flatMap((a, i) => old.slice(0, i).map((b) => a.map((x, k) => (x + b[k]) / 2)));
    assert.ok(middles.some((middle) => near(middle, [...delta.from])));
    seen++;
  }
  assert.ok(seen > 0);
});

test("relative positions differ by the smallest corner", async () => {
  const [mirror, relative] = [await mirrorOf(sphere), await mirrorOf(sphere, { relative: true })];
  const { min } = mirror.last.contents;
  for (let k = 0; k < 3 * mirror.vertices; k++) {
    assert.ok(Math.abs(mirror.position[k] - relative.position[k] - min[k % 3]) < 1e-6);
  }
});

test("a changed byte is told with its atom, and the mesh before it stays", async () => {
  const { contents } = (await mirrorOf(sphere)).last;
  const from = contents.levels[3].end; // The atoms of level 2 begin here.
  const bad = sphere.slice();
  bad[from] ^= 1;
  const mirror = new Mirror();
  const error = await (async () => {
    for await (const delta of decode(bad, { pool })) mirror.apply(delta);
  })().catch((error) => error);
  assert.ok(error instanceof FormatError);
  assert.deepEqual([error.offset, error.atom.level], [from, 2]);
  assert.match(error.message, new RegExp(`atom ${error.atom.index} \\(\\w+, level 2\\)`, "i"));
  assert.equal(mirror.last.level.level, 3);
  assert.equal(mirror.triangles, contents.levels[3].triangles);
});

test("what is no .uwm file, or ends early, is refused", async () => {
  await assert.rejects(mirrorOf(new TextEncoder().encode("ply\nformat ascii 1.0\n")), /not a \.uwm file/);
  await assert.rejects(mirrorOf(new Uint8Array(0)), FormatError);
  await assert.rejects(mirrorOf(sphere.slice(0, 60)), FormatError);
  await assert.rejects(mirrorOf(sphere.slice(0, base - 1)), FormatError);
});

test("no more is decoded than is wanted", async () => {
  const { contents } = (await mirrorOf(sphere)).last;
  const mirror = await mirrorOf(sphere, { until: { level: 5 } });
  assert.equal(mirror.triangles, contents.levels[5].triangles);
  assert.equal(mirror.last.bytes, contents.levels[5].end);
  const few = await mirrorOf(sphere, { until: { triangles: 40 } });
  assert.ok(few.triangles <= 40 && few.triangles > 30);
  const error = contents.levels[4].maxError;
  assert.ok((await mirrorOf(sphere, { until: { error } })).last.level.maxError <= error);
  // The same number as a root mean square is met by a coarser level.
  const coarsest = (name) => contents.levels.findLastIndex((level) => level[name] <= error);
  assert.ok(coarsest("rmsError") > coarsest("maxError"));
  for (const [measure, name] of [["max", "maxError"], ["rms", "rmsError"]]) {
    assert.equal((await mirrorOf(sphere, { until: { error, measure } })).last.level.level, coarsest(name));
  }
});

test("levels can be shown again", async () => {
  const [mirror, stream] = [new Mirror(), decode(torus, { pool, levels: true })];
  for await (const delta of stream) mirror.apply(delta);
  const [triangles, exact] = [mirror.triangles, mirror.exact()];
  for (const { level, triangles } of [...mirror.last.contents.levels].reverse()) {
    if (level === 0) continue;
    mirror.apply(await stream.show(level));
    assert.deepEqual([mirror.triangles, mirror.last.level.level], [triangles, level]);
  }
  mirror.apply(await stream.show(null));
  assert.deepEqual([mirror.triangles, mirror.exact()], [triangles, exact]);
  stream.close();
});

test("a coarser level while the file arrives", async () => {
  const [mirror, stream] = [new Mirror(), decode(pieces(sphere, 1), { pool, levels: true })];
  let shown = false;
  for await (const delta of stream) {
    mirror.apply(delta);
    if (!shown && delta.level?.level === 4) {
      shown = true;
      mirror.apply(await stream.show(8));
      assert.equal(mirror.triangles, mirror.last.contents.levels[8].triangles);
      mirror.apply(await stream.show(null));
    }
  }
  assert.ok(shown);
  assert.equal(mirror.exact(), (await mirrorOf(sphere)).exact());
  stream.close();
});

test("connections that break are taken up where they broke", async () => {
  const files = { "/mesh.uwm": { bytes: sphere, etag: '"1"', breakAfter: 300 } };
  await within(files, async ({ url, requests }) => {
    const mirror = await mirrorOf(`${url}/mesh.uwm`);
    assert.equal(mirror.exact(), (await mirrorOf(sphere)).exact());
    const ranges = requests.map(({ headers }) => headers.range);
    assert.equal(ranges[0], undefined);
    // The table of contents is longer than the first piece, or not: what is wanted may be known or not.
    ranges.slice(1).forEach((range, k) => assert.match(range, new RegExp(`^bytes=${300 * (k + 1)}-(${end - 1})?$`)));
    assert.equal(ranges.length, Math.ceil(end / 300));
    assert.ok(requests.slice(1).every(({ headers }) => headers["if-range"] === '"1"'));
  });
});

test("a server without ranges sends the file again, and what is known is skipped", async () => {
  const file = { bytes: sphere, etag: '"1"', breakAfter: most, ranges: false, onBreak: (file) => (file.breakAfter = undefined) };
  await within({ "/mesh.uwm": file }, async ({ url }) => {
    const mirror = await mirrorOf(fetch(`${url}/mesh.uwm`));
    assert.equal(mirror.exact(), (await mirrorOf(sphere)).exact());
  });
});

test("a file that has become another one begins anew", async () => {
  const file = { bytes: sphere, etag: '"1"', breakAfter: most };
  file.onBreak = () => Object.assign(file, { bytes: torus, etag: '"2"', breakAfter: undefined });
  await within({ "/mesh.uwm": file }, async ({ url, requests }) => {
    const mirror = await mirrorOf(`${url}/mesh.uwm`);
    assert.equal(requests[1].headers.range, `bytes=${most}-${end - 1}`);
    assert.equal(mirror.exact(), (await mirrorOf(torus)).exact());
  });
});

test("after a connection error the mesh stands, and iterating goes on", async () => {
  const file = { bytes: sphere, etag: '"1"', breakAfter: most };
  await within({ "/mesh.uwm": file }, async ({ url }) => {
    const [mirror, stream] = [new Mirror(), decode(`${url}/mesh.uwm`, { pool, retries: 0 })];
    const follow = async () => {
      for await (const delta of stream) mirror.apply(delta);
    };
    const error = await follow().catch((error) => error);
    assert.ok(error instanceof ConnectionError);
    assert.equal(error.received, most);
    assert.ok(mirror.triangles > 0 && mirror.triangles < 80);
    file.breakAfter = undefined;
    await follow();
    assert.equal(mirror.triangles, 80);
  });
});

test("a file that is cut off is asked for as often as there are retries, and then what is missing is told", async () => {
  let tag = 0;
  const cut = { bytes: sphere.slice(0, most) };
  const files = {
    "/tagged.uwm": { ...cut, etag: '"1"' },
    "/untagged.uwm": { ...cut },
    "/always-new.uwm": { ...cut, etag: () => `"${tag++}"` },
    "/no-ranges.uwm": { ...cut, etag: '"1"', ranges: false },
    "/absurd.uwm": { ...cut, etag: '"1"', absurd: true },
  };
  await within(files, async ({ url, requests }) => {
    for (const [path, each] of [["tagged", 2], ["untagged", 1], ["always-new", 1], ["no-ranges", 1], ["absurd", 2]]) {
      for (const options of [{}, { head: 100 }]) {
        const before = requests.length;
        const error = await mirrorOf(`${url}/${path}.uwm`, { retries: 1, ...options }).catch((error) => error);
        assert.ok(error instanceof ConnectionError, `${path}: ${error}`);
        assert.deepEqual([error.received, error.wanted], [most, end], path);
        assert.match(error.message, new RegExp(`^${url}/${path}.uwm: lost after ${most} of the ${end} bytes wanted: `));
        // Once, and once again: where the range is refused, the whole is asked for to see whether it is another file.
        if (!options.head) assert.equal(requests.length - before, 1 + each, path);
      }
    }
  });
});

test("a connection that breaks at the same byte again and again is given up, one that goes on is not", async () => {
  let breaks = 0;
  const file = { bytes: sphere, etag: '"1"', ranges: false, breakAfter: 200, onBreak: (file) => (file.breakAfter += breaks++ % 2 ? 150 : 0) };
  await within({ "/mesh.uwm": file }, async ({ url }) => {
    // Every byte count is reached twice: one failure in a row more than retries allow would end it.
    assert.equal((await mirrorOf(`${url}/mesh.uwm`, { retries: 2 })).triangles, 80);
    Object.assign(file, { breakAfter: most, onBreak: undefined });
    const error = await mirrorOf(`${url}/mesh.uwm`, { retries: 2 }).catch((error) => error);
    assert.deepEqual([error.name, error.received], ["ConnectionError", most]);
  });
});

test("a prefix that the server calls one ends as a prefix, and says which level it reaches", async () => {
  const { levels } = (await mirrorOf(sphere)).last.contents;
  const headers = { "unweld-bytes": `0-${levels[2].end}` };
  const files = {
    "/refine": { bytes: sphere.slice(0, levels[2].end), etag: '"1"', headers },
    "/breaks": { bytes: sphere.slice(0, levels[2].end), etag: '"1"', headers, breakAfter: levels[4].end },
    "/less": { bytes: sphere.slice(0, levels[4].end), etag: '"1"', headers },
  };
  await within(files, async ({ url, requests }) => {
    for (const [path, options, count] of [["refine", {}, 1], ["refine", { head: 1_000_000 }, 1], ["breaks", {}, 2]]) {
      const before = requests.length;
      const { triangles, last } = await mirrorOf(`${url}/${path}`, options);
      assert.deepEqual([triangles, last.level.level, last.prefix, last.complete], [levels[2].triangles, 2, true, false]);
      assert.equal(requests.length - before, count);
    }
    // What is wanted is there, or more is wanted than there will ever be.
    const stream = decode(`${url}/refine`, { pool, keep: true, until: { level: 4 } });
    const mirror = new Mirror();
    const at = [];
    for (const until of [null, { level: 2 }, { level: 0 }, {}, { level: 3 }]) {
      if (until) await stream.want(until);
      for await (const delta of stream) mirror.apply(delta);
      at.push([mirror.last.level.level, mirror.last.prefix, mirror.last.complete]);
    }
    assert.deepEqual(at, [[4, false, true], [2, false, true], [2, true, false], [2, true, false], [2, false, true]]);
    stream.close();
    // One that ends before it said it would is cut off.
    const error = await mirrorOf(`${url}/less`, { retries: 0 }).catch((error) => error);
    assert.deepEqual([error.name, error.received], ["ConnectionError", levels[4].end]);
  });
});

test("what ends early is a prefix where the caller says so, if it holds the base", async () => {
  const { levels } = (await mirrorOf(sphere)).last.contents;
  const cut = sphere.slice(0, levels[3].end + 3);
  await within({ "/cut.uwm": { bytes: cut, etag: '"1"' } }, async ({ url }) => {
    for (const input of [cut, new Blob([cut]), pieces(cut, 7), `${url}/cut.uwm`]) {
      const { triangles, last } = await mirrorOf(input, { prefix: true });
      assert.deepEqual([triangles, last.level.level, last.prefix, last.complete], [levels[3].triangles, 3, true, false]);
    }
  });
  for (const length of [0, 60, levels.at(-1).end - 1]) await assert.rejects(mirrorOf(sphere.slice(0, length), { prefix: true }), FormatError);
  const whole = (await mirrorOf(sphere, { prefix: true })).last;
  assert.deepEqual([whole.prefix, whole.complete], [false, true]);
});

test("what there is not to be said is refused by its name", async () => {
  const known = "level, error, measure, triangles, textures";
  assert.throws(() => decode(sphere, { until: { eror: 1 } }), { name: "TypeError", message: `until has no "eror": only ${known}` });
  for (const value of [NaN, -1, "1", null]) assert.throws(() => decode(sphere, { until: { error: value } }), /^TypeError: until.error cannot be /);
  assert.throws(() => decode(sphere, { untill: {} }), /^TypeError: decode has no "untill": only until, /);
  const stream = decode(sphere, { pool, keep: true });
  await assert.rejects(stream.want({ Level: 3 }), { name: "TypeError", message: `until has no "Level": only ${known}` });
  for await (const { complete } of stream) if (complete) break;
});

test("what cannot be loaded is named by its address", async () => {
  await within({ "/page.html": { bytes: new TextEncoder().encode("<!doctype html>"), headers: { "content-type": "text/html" } } }, async ({ url }) => {
    await assert.rejects(mirrorOf(sphere, { wasm: `${url}/gone.wasm` }), new RegExp(`${url}/gone.wasm: 404`));
    await assert.rejects(mirrorOf(sphere, { wasm: `${url}/page.html` }), new RegExp(`${url}/page.html: .*WebAssembly`));
    await assert.rejects(mirrorOf(sphere, { wasm: "file:///no/such.wasm" }), /file:\/\/\/no\/such.wasm: /);
  });
});

test("requests can be made by another function", async () => {
  await within({ "/mesh.uwm": { bytes: sphere, etag: '"1"' } }, async ({ url }) => {
    const asked = [];
    const own = (address, init) => (asked.push(String(address)), fetch(address, init));
    assert.equal((await mirrorOf(`${url}/mesh.uwm`, { fetch: own })).triangles, 80);
    assert.deepEqual(asked, [`${url}/mesh.uwm`]);
  });
});

test("what the server refuses is told at once", async () => {
  await within({ "/gone": { status: 404 } }, async ({ url, requests }) => {
    await assert.rejects(mirrorOf(`${url}/gone`), (error) => error instanceof HttpError && error.status === 404);
    assert.equal(requests.length, 1);
  });
});

test("a signal ends the stream with its reason", async () => {
  await within({ "/mesh.uwm": { bytes: sphere, rate: 2000 } }, async ({ url }) => {
    const [controller, mirror] = [new AbortController(), new Mirror()];
    const reason = new Error("enough");
    const follow = async () => {
      for await (const delta of decode(`${url}/mesh.uwm`, { pool, signal: controller.signal })) {
        mirror.apply(delta);
        controller.abort(reason);
      }
    };
    await assert.rejects(follow(), reason);
    assert.ok(mirror.last && !mirror.last.complete);
  });
});

test("a server that says there is nothing behind what was received has another file", async () => {
  const file = { bytes: sphere, etag: '"1"', breakAfter: most };
  file.onBreak = () => Object.assign(file, { bytes: torus, etag: '"2"', breakAfter: undefined, short: true });
  await within({ "/mesh.uwm": file }, async ({ url }) => {
    assert.equal((await mirrorOf(`${url}/mesh.uwm`)).exact(), (await mirrorOf(torus)).exact());
  });
});

test("what is wanted may grow, and only what is missing is asked for", async () => {
  await within({ "/mesh.uwm": { bytes: torus, etag: '"1"' } }, async ({ url, requests }) => {
    const whole = await mirrorOf(torus);
    const { levels, wanted } = whole.last.contents;
    // A second request asks for three times as much as the first one, where the table of contents is longer: not beyond the base.
    const head = Math.floor(levels.at(-1).end / 4);
    const [mirror, stream] = [new Mirror(), decode(`${url}/mesh.uwm`, { pool, keep: true, head, until: { level: Infinity } })];
    const follow = async () => {
      for await (const delta of stream) mirror.apply(delta);
    };
    await follow();
    assert.equal(mirror.triangles, levels.at(-1).triangles, "the base alone");
    assert.equal(mirror.last.complete, true);
    for (const level of [levels.length - 2, 3, 2]) {
      await stream.want({ level });
      await follow();
      assert.deepEqual([mirror.triangles, mirror.last.level.level, mirror.last.bytes], [levels[level].triangles, level, levels[level].end]);
      assert.equal(stream.received, levels[level].end, "not a byte more");
    }
    await stream.want({ level: 4 });
    await follow();
    assert.equal(mirror.triangles, levels[2].triangles, "what is there stays");
    await stream.want({});
    await follow();
    assert.deepEqual([mirror.exact(), mirror.last.bytes], [whole.exact(), wanted.end]);
    const ranges = requests.map(({ headers }) => headers.range);
    assert.deepEqual(ranges.slice(-3), [[4, 3], [3, 2], [2, -1]].map(([, to], k) => {
      const from = [levels[levels.length - 2].end, levels[3].end, levels[2].end][k];
      return `bytes=${from}-${(to < 0 ? wanted.end : levels[to].end) - 1}`;
    }));
    stream.close();
    await assert.rejects(stream.want({}), /closed/);
  });
});

test("what is wanted changes while it is on its way", async () => {
  const whole = await mirrorOf(sphere);
  for (const input of [sphere, () => pieces(sphere, 7)]) {
    const [mirror, stream] = [new Mirror(), decode(typeof input === "function" ? input() : input, { pool, keep: true, until: { level: Infinity } })];
    const asked = [];
    do {
      for await (const delta of stream) {
        mirror.apply(delta);
        const next = delta.level && delta.level.level - 1;
        if (next !== null && next >= 0 && !asked.includes(next)) {
          asked.push(next);
          await stream.want(next > 0 ? { level: next } : {});
        }
      }
    } while (stream.isOpen);
    assert.equal(mirror.exact(), whole.exact());
    stream.close();
  }
});

test("less is wanted: the stream ends early, and a second want goes on", async () => {
  await within({ "/mesh.uwm": { bytes: sphere, etag: '"1"', rate: 300 } }, async ({ url, requests }) => {
    const [mirror, stream] = [new Mirror(), decode(`${url}/mesh.uwm`, { pool, keep: true })];
    for await (const delta of stream) {
      mirror.apply(delta);
      if (delta.level?.level === 6) await stream.want({ level: 6 });
    }
    assert.ok(mirror.triangles < 80 && mirror.last.complete);
    const { received } = stream;
    await new Promise((resolve) => setTimeout(resolve, 300));
    assert.equal(stream.received, received, "nothing more is read");
    await stream.want({});
    for await (const delta of stream) mirror.apply(delta);
    assert.equal(mirror.exact(), (await mirrorOf(sphere)).exact());
    assert.deepEqual(requests.map(({ headers }) => headers.range), [undefined, `bytes=${received}-${end - 1}`]);
    stream.close();
  });
});

test("a first request in part: of servers without ranges, of an empty file, of one that is smaller", async () => {
  const files = {
    "/plain.uwm": { bytes: sphere, etag: '"1"', ranges: false },
    "/small.uwm": { bytes: sphere, etag: '"1"' },
    "/untagged.uwm": { bytes: sphere },
    "/empty.uwm": { bytes: new Uint8Array(0), etag: '"1"', short: true },
  };
  await within(files, async ({ url }) => {
    const exact = (await mirrorOf(sphere)).exact();
    assert.equal((await mirrorOf(`${url}/plain.uwm`, { head: 10 })).exact(), exact);
    assert.equal((await mirrorOf(`${url}/small.uwm`, { head: 1_000_000 })).exact(), exact);
    assert.equal((await mirrorOf(`${url}/small.uwm`, { head: 10 })).exact(), exact);
    assert.equal((await mirrorOf(`${url}/untagged.uwm`, { head: 10 })).exact(), exact);
    delete files["/empty.uwm"].short;
    await assert.rejects(mirrorOf(`${url}/empty.uwm`), FormatError);
  });
});

test("a file that is replaced between two wants begins anew", async () => {
  const file = { bytes: sphere, etag: '"1"' };
  await within({ "/mesh.uwm": file }, async ({ url }) => {
    const [mirror, stream] = [new Mirror(), decode(`${url}/mesh.uwm`, { pool, keep: true, head: Math.floor(base / 4), until: { level: 6 } })];
    for await (const delta of stream) mirror.apply(delta);
    Object.assign(file, { bytes: torus, etag: '"2"' });
    await stream.want({});
    for await (const delta of stream) mirror.apply(delta);
    assert.equal(mirror.exact(), (await mirrorOf(torus)).exact());
    stream.close();
  });
});

test("a stream that is closed leaves its connection", async () => {
  const file = { bytes: sphere, etag: '"1"', rate: 1000 };
  await within({ "/mesh.uwm": file }, async ({ url, requests }) => {
    for await (const delta of decode(`${url}/mesh.uwm`, { pool })) if (delta.triangles > 0) break;
    await new Promise((resolve) => setTimeout(resolve, 900));
    assert.equal(requests.length, 1, "it is not taken up again");
  });
});

test("jumps are told where they are wanted", async () => {
  const [plain, told] = [await mirrorOf(sphere), []];
  assert.equal(plain.last.jump, 0);
  for await (const delta of decode(pieces(sphere, 1), { pool, jumps: true })) told.push(delta.jump);
  assert.ok(told.every((jump) => jump >= 0 && Number.isFinite(jump)));
  // The sphere has radius 1 and 12 vertices at its base: no edge is flipped across more than its radius.
  assert.ok(told.some((jump) => jump > 0) && Math.max(...told) < 1);
});
