// The site that is measured: the page, three.js, each loader as a user's bundler makes it, the meshes. All from memory.

import { createServer } from "node:http";
import { readFile, readdir } from "node:fs/promises";
import { extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { brotliCompressSync, constants } from "node:zlib";
import { build } from "esbuild";

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".glb": "model/gltf-binary" };
const PAGE = `<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">
<script type="importmap">{ "imports": { "three": "/three.module.js" } }</script>
<body style="margin: 0; background: #fff"><script type="module" src="/stage.js"></script></body>`;

/**
 * Serves `meshes` (see `prepare`) and the page. `decoders`: what a page without anything but three.js fetches for each kind of loader,
 * as bytes with brotli.
 */
export async function serve(meshes) {
  const files = await scripts();
  files.set("/", { bytes: Buffer.from(PAGE), type: "text/html" });
  files.set("/scene", { bytes: Buffer.from(PAGE.replace("stage.js", "scene.js")), type: "text/html" });
  files.set("/bytes", { bytes: Buffer.alloc(1_000_000, 1), type: "application/octet-stream" });
  for (const { files: kinds } of meshes) {
    for (const { path, sent, encoding } of Object.values(kinds)) {
      files.set(`/meshes/${path}`, { bytes: sent, encoding, type: TYPES[extname(path)] ?? "model/vnd.unweld" });
    }
  }
  const server = createServer((request, response) => {
    const file = files.get(new URL(request.url, "http://host").pathname);
    if (!file) return void response.writeHead(404).end();
    const { bytes, type, encoding } = file;
    const headers = { "content-type": type, "accept-ranges": "bytes", etag: `"${bytes.length}"`, ...(encoding && { "content-encoding": encoding }) };
    const [, from, to] = /^bytes=(\d+)-(\d*)$/.exec((!encoding && request.headers.range) || "") ?? [];
    if (from === undefined || Number(from) >= bytes.length) {
      response.writeHead(200, { ...headers, "content-length": bytes.length });
      return void response.end(bytes);
    }
    const end = Math.min(to ? Number(to) + 1 : Infinity, bytes.length);
    response.writeHead(206, { ...headers, "content-length": end - from, "content-range": `bytes ${from}-${end - 1}/${bytes.length}` });
    response.end(bytes.subarray(Number(from), end));
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const sum = (...names) => names.reduce((sum, name) => sum + files.get(name).bytes.length, 0);
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    decoders: {
      unweld: sum("/unweld.js", "/worker.js", "/unweld.wasm"),
      draco: sum("/draco.js", "/draco/draco_wasm_wrapper.js", "/draco/draco_decoder.wasm"),
      meshopt: sum("/meshopt.js"),
    },
    close: () => {
      server.closeAllConnections();
      server.close();
    },
  };
}

/** Scripts and WebAssembly, with brotli. */
async function scripts() {
  const local = (path) => fileURLToPath(new URL(path, import.meta.url));
  const three = { name: "three", setup: (build) => build.onResolve({ filter: /^three$/ }, () => ({ path: "three", external: true })) };
  const { outputFiles } = await build({
    entryPoints: ["stage", "unweld", "draco", "meshopt", "pictures", "scene"].map((name) => local(`page/${name}.js`)),
    outdir: local("page"),
    bundle: true,
    format: "esm",
    target: "es2022",
    minify: true,
    legalComments: "none",
    write: false,
    plugins: [three],
  });
  const bundles = outputFiles.map(({ path, contents }) => [`/${path.split("/").at(-1)}`, Buffer.from(contents)]);
  const draco = local("../node_modules/three/examples/jsm/libs/draco/gltf");
  const rest = [
    ["/three.module.js", local("../node_modules/three/build/three.module.js")],
    ["/three.core.js", local("../node_modules/three/build/three.core.js")],
    ["/worker.js", local("../dist/worker.js")],
    ["/unweld.wasm", local("../dist/unweld.wasm")],
    ...(await readdir(draco)).map((name) => [`/draco/${name}`, join(draco, name)]),
  ];
  const read = await Promise.all(rest.map(async ([address, path]) => [address, await readFile(path)]));
  // Three.js is there before the clock runs, so that its size does not matter.
  const quality = (address) => ({ params: { [constants.BROTLI_PARAM_QUALITY]: address.startsWith("/three.") ? 4 : 11 } });
  const packed = ([address, bytes]) => {
    return [address, { bytes: brotliCompressSync(bytes, quality(address)), encoding: "br", type: TYPES[extname(address)] }];
  };
  return new Map([...bundles, ...read].map(packed));
}
