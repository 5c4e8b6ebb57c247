// The page as the program serves it: it wants nothing from elsewhere, keeps to its own policy, shows the mesh of the demonstration, and asks for
// a token where the server wants one. What it sends of a mesh ends as a prefix of it.
// `node tests/program.mjs UNWELD [FOLDER FOR PICTURES]`, with the program's path.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { decode, WorkerPool } from "../dist/unweld.js";
import { ARGUMENTS, chromium } from "./chromium.mjs";

const { chromium: browserType } = await import("playwright-core");
const [program, pictures] = process.argv.slice(2);
const folder = await mkdtemp(join(tmpdir(), "unweld-served-"));
const children = [];
/** Runs the program; the address that it tells. */
const addressOf = async (...words) => {
  const child = spawn(program, [...words, "--addr", "127.0.0.1:0"], { stdio: ["ignore", "pipe", "inherit"] });
  children.push(child);
  for await (const line of createInterface(child.stdout)) {
    const [address] = /http:\/\/[^ ]+/.exec(line) ?? [];
    if (address) return address;
  }
  assert.fail(`${words[0]} told no address`);
};
let context;
try {
  const address = await addressOf("demo", "--quiet", "--no-open", "--output", join(folder, "demo"));
  context = await browserType.launchPersistentContext(join(folder, "profile"), {
    executablePath: chromium,
    viewport: { width: 1280, height: 800 },
    args: ARGUMENTS,
  });
  const page = await context.newPage();
  const [faults, requests] = [[], []];
  page.on("pageerror", (error) => faults.push(error));
  page.on("console", (told) => told.type() === "error" && faults.push(told.text()));
  context.on("request", (request) => requests.push(request.url()));
  await page.goto(address);
  await page.waitForFunction(() => globalThis.unweld.complete, null, { timeout: 60_000 });
  // The scene comes first in the list.
  const scene = await page.evaluate(() => [document.getElementById("meshes").value, globalThis.unweld.bytes, globalThis.unweld.total]);
  assert.deepEqual([scene[0], scene[1] > 50_000], ["meshes/demo-scene.uwm", true]);
  await page.selectOption("#meshes", "meshes/demo.uwm");
  await page.waitForFunction((before) => globalThis.unweld.complete && globalThis.unweld.total !== before, scene[2], { timeout: 60_000 });
  const { triangles, bytes, total } = await page.evaluate(() => ({ ...globalThis.unweld }));
  assert.deepEqual([triangles, bytes], [81_920, total], "an icosphere subdivided six times has 20 * 4^6 triangles");
  const elsewhere = requests.filter((url) => !url.startsWith(address) && !/^(data|blob):/.test(url));
  assert.deepEqual([faults, elsewhere], [[], []]);
  const { meshes } = await (await fetch(new URL("meshes", address))).json();
  assert.deepEqual(meshes.map(({ name }) => name), ["demo-scene.uwm", "demo.uwm"]);
  const half = new URL(`meshes/demo/refine?max_bytes=${total >> 1}`, address);
  let last;
  for await (const delta of decode(half, { pool: new WorkerPool(0), retries: 0 })) last = delta;
  assert.deepEqual([last.prefix, last.complete], [true, false]);
  assert.ok(last.triangles > 0 && last.level.level > 0 && last.bytes <= total >> 1);
  if (pictures) {
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(pictures, "served.png") });
    await page.setViewportSize({ width: 390, height: 844 });
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(pictures, "served-phone.png") });
  }
  // Another server, whose meshes are for those with a token; one of them is damaged.
  await writeFile(join(folder, "tokens"), "right\n");
  await writeFile(join(folder, "demo", "damaged.uwm"), "not a mesh");
  const closed = await addressOf("serve", join(folder, "demo"), "--token-file", join(folder, "tokens"));
  await page.goto(closed);
  for (const token of ["wrong", "right"]) {
    await page.waitForSelector("#entry", { state: "visible" });
    await page.fill("#token", token);
    await page.click("#entry button");
    if (token === "wrong") await page.waitForFunction(() => document.getElementById("message").textContent === "This token is not known here.");
  }
  await page.waitForFunction(() => globalThis.unweld.complete, null, { timeout: 60_000 });
  const [shown, disabled] = await page.evaluate(() => [
    document.getElementById("entry").checkVisibility(),
    [...document.querySelectorAll("#meshes option:disabled")].map(({ text }) => text.split(" · ")[0]),
  ]);
  assert.deepEqual([shown, disabled], [false, ["damaged.uwm"]]);
  console.log(`${triangles.toLocaleString("en")} triangles in ${bytes.toLocaleString("en")} bytes, ${requests.length} requests, none elsewhere`);
} finally {
  await context?.close();
  for (const child of children) {
    const ended = new Promise((resolve) => child.once("exit", resolve));
    child.kill("SIGINT");
    await ended;
  }
  await rm(folder, { recursive: true, force: true });
}
