// A server to kill: `node served.mjs PORT RATE FILE [NAME]` serves web/dist and one mesh at `meshes/NAME`, RATE bytes a second. Tells its port.

import { readFile } from "node:fs/promises";
import { createHash } from "node:crypto";
import { basename } from "node:path";
import { fileURLToPath } from "node:url";
import { serve } from "./server.mjs";

const [port, rate, file, name = basename(file)] = process.argv.slice(2);
const bytes = await readFile(file);
const etag = `"${createHash("sha256").update(bytes).digest("hex").slice(0, 16)}"`;
const list = { bytes: Buffer.from(JSON.stringify({ meshes: [{ name }], next: null })) };
const mesh = { bytes, etag, rate: Number(rate) || undefined };
const { url } = await serve({ [`/meshes/${name}`]: mesh, "/meshes": list }, fileURLToPath(new URL("../dist", import.meta.url)), Number(port));
console.log(url);
