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
 * as bytes with brotli; `sceneDecoders`: the same for scenes, without the GLTFLoader that they all want.
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
  const loaders = await sceneLoaders();
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    decoders: {
      unweld: sum("/unweld.js", "/worker.js", "/unweld.wasm"),
      draco: sum("/draco.js", "/draco/draco_wasm_wrapper.js", "/draco/draco_decoder.wasm"),
      meshopt: sum("/meshopt.js"),
    },
    sceneDecoders: {
      unweld: loaders.unweld + sum("/worker.js", "/unweld.wasm"),
      draco: loaders.draco + sum("/draco/draco_wasm_wrapper.js", "/draco/draco_decoder.wasm"),
      meshopt: loaders.meshopt,
    },
    close: () => {
      server.closeAllConnections();
      server.close();
    },
  };
}

/** Bytes with brotli of what loads scenes, each by itself, without three.js and GLTFLoader. */
async function sceneLoaders() {
  const others = { name: "others", setup: (build) => build.onResolve({ filter: /^three$|GLTFLoader/ }, () => ({ path: "three", external: true })) };
  const from = { unweld: "../dist/gltf.js", draco: "three/addons/loaders/DRACOLoader.js", meshopt: "three/addons/libs/meshopt_decoder.module.js" };
  const sizes = Object.entries(from).map(async ([kind, path]) => {
    const contents = `export * from "${path}";`;
    const { outputFiles } = await build({
      stdin: { contents, resolveDir: fileURLToPath(new URL(".", import.meta.url)) },
      ...{ bundle: true, format: "esm", target: "es2022", minify: true, legalComments: "none", write: false, plugins: [others] },
    });
    return [kind, brotliCompressSync(outputFiles[0].contents).length];
  });
  return Object.fromEntries(await Promise.all(sizes));
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
