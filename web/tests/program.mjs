// The page as the program serves it: it wants nothing from elsewhere, keeps to its own policy, and shows the mesh of the demonstration.
// `node tests/program.mjs UNWELD [FOLDER FOR PICTURES]`, with the program's path.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

const chromium = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(
  (path) => path && existsSync(path),
);
const { chromium: browserType } = await import("playwright-core");
const [program, pictures] = process.argv.slice(2);
const folder = await mkdtemp(join(tmpdir(), "unweld-served-"));
const demo = spawn(program, ["demo", "--quiet", "--no-open", "--addr", "127.0.0.1:0", "--output", join(folder, "demo")]);
let context;
try {
  let address;
  for await (const line of createInterface(demo.stdout)) {
    address = /http:\/\/[^ ]+/.exec(line)?.[0];
    if (address) break;
  }
  assert.ok(address, "the demonstration told no address");
  context = await browserType.launchPersistentContext(join(folder, "profile"), {
    executablePath: chromium,
    viewport: { width: 1280, height: 800 },
    args: ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"].concat([
      "--disable-component-update",
      "--disable-sync",
      "--disable-gpu",
      "--enable-unsafe-swiftshader",
    ]),
  });
  const page = await context.newPage();
  const [faults, requests] = [[], []];
  page.on("pageerror", (error) => faults.push(error));
  page.on("console", (told) => told.type() === "error" && faults.push(told.text()));
  context.on("request", (request) => requests.push(request.url()));
  await page.goto(address);
  await page.waitForFunction(() => globalThis.unweld.complete, null, { timeout: 60_000 });
  const { triangles, bytes, total } = await page.evaluate(() => ({ ...globalThis.unweld }));
  assert.deepEqual([triangles, bytes], [81_920, total], "an icosphere subdivided six times has 20 * 4^6 triangles");
  const elsewhere = requests.filter((url) => !url.startsWith(address) && !/^(data|blob):/.test(url));
  assert.deepEqual([faults, elsewhere], [[], []]);
  if (pictures) {
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(pictures, "served.png") });
    await page.setViewportSize({ width: 390, height: 844 });
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(pictures, "served-phone.png") });
  }
  console.log(`${triangles.toLocaleString("en")} triangles in ${bytes.toLocaleString("en")} bytes, ${requests.length} requests, none elsewhere`);
} finally {
  await context?.close();
  const ended = new Promise((resolve) => demo.once("exit", resolve));
  demo.kill("SIGINT");
  await ended;
  await rm(folder, { recursive: true, force: true });
}
