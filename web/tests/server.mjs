// A small server of files in memory and of folders, with Range and If-Range; it can be told to behave badly.

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join, normalize } from "node:path";

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".json": "application/json" };

/**
 * `files`: by path, `{ bytes, etag, breakAfter, ranges, status, rate }`. `breakAfter`: bytes after which every connection is cut;
 * `ranges`: false for a server that does not know them; `short`: every range lies behind the end; `absurd`: a range behind the end is sent, empty;
 * `headers`: further ones; `rate`: bytes a second. `folder`: served for all other paths. Port 0 is any.
 */
export async function serve(files, folder, port = 0) {
  const requests = [];
  const server = createServer(async (request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://host").pathname);
    requests.push({ path, headers: request.headers });
    const file = files[path];
    if (!file) return fromFolder(folder, path, response);
    if (file.status) return void response.writeHead(file.status).end();
    const { bytes } = file;
    const etag = typeof file.etag === "function" ? file.etag() : file.etag;
    const headers = { "content-type": "model/vnd.unweld", "cache-control": "no-store", ...(etag ? { etag } : {}), ...file.headers };
    const [, from, to] = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "") ?? [];
    const stands = !request.headers["if-range"] || request.headers["if-range"] === etag;
    if (from !== undefined && file.short) return void response.writeHead(416).end();
    const ranged = from !== undefined && file.ranges !== false && stands;
    const start = ranged ? Number(from) : 0;
    if (start >= bytes.length && ranged && !file.absurd) {
      return void response.writeHead(416, { "content-range": `bytes */${bytes.length}` }).end();
    }
    const last = ranged && to ? Math.min(bytes.length, Number(to) + 1) : bytes.length;
    if (ranged) headers["content-range"] = `bytes ${start}-${last - 1}/${bytes.length}`;
    response.writeHead(ranged ? 206 : 200, { ...headers, "content-length": last - start });
    response.flushHeaders();
    const end = Math.min(last, start + (file.breakAfter ?? Infinity));
    const piece = file.rate ? Math.max(1, Math.round(file.rate / 50)) : 16384;
    for (let at = start; at < end && !response.destroyed; at += piece) {
      const more = response.write(bytes.subarray(at, Math.min(end, at + piece)));
      if (file.rate) await new Promise((resolve) => setTimeout(resolve, 20));
      else if (!more) await new Promise((resolve) => response.once("drain", resolve).once("close", resolve));
      file.sent = (file.sent ?? 0) + Math.min(piece, end - at);
    }
    if (end === last) return void response.end();
    file.onBreak?.(file);
    setTimeout(() => response.destroy(), 20);
  });
  await new Promise((resolve) => server.listen(port, "127.0.0.1", resolve));
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    requests,
    close: () => {
      server.closeAllConnections();
      server.close();
    },
  };
}

async function fromFolder(folder, path, response) {
  const name = normalize(path === "/" ? "/index.html" : path);
  const bytes = folder && !name.includes("..") ? await readFile(join(folder, name)).catch(() => null) : null;
  if (!bytes) return void response.writeHead(404).end();
  response.writeHead(200, { "content-type": TYPES[extname(name)] ?? "application/octet-stream" }).end(bytes);
}
