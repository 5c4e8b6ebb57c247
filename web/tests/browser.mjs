// The viewer in Chromium: a mesh appears before its last byte, grows to all its triangles, and the page stays fluid.
// `node tests/browser.mjs [FILE.uwm] [FOLDER FOR PICTURES]`

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdir, mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { fileURLToPath } from "node:url";
import { serve } from "./server.mjs";

const chromium = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(
  (path) => path && existsSync(path),
);
const { chromium: browserType } = await import("playwright-core").catch(() => ({}));
if (!chromium || !browserType) {
  console.log(`skipped: ${chromium ? "playwright-core is not installed (cd web && npm ci)" : "there is no Chromium"}`);
  process.exit(process.env.CI === "true" ? 1 : 0);
}

const local = (path) => fileURLToPath(new URL(path, import.meta.url));
const [file = local("../../tests/golden/sphere.uwm"), pictures] = process.argv.slice(2);
const bytes = await readFile(file);
const name = basename(file);
// Two seconds for the whole of it, whatever its size.
const mesh = { bytes, etag: '"1"', rate: Math.max(200, Math.round(bytes.length / 2)) };
const list = { bytes: Buffer.from(JSON.stringify([{ name }])) };
const server = await serve({ [`/meshes/${name}`]: mesh, "/meshes": list }, local("../dist"));
const profile = await mkdtemp(join(tmpdir(), "unweld-browser-"));
const context = await browserType.launchPersistentContext(profile, {
  executablePath: chromium,
  viewport: { width: 1280, height: 800 },
  args: ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"].concat([
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
  ]),
});

try {
  if (pictures) await mkdir(pictures, { recursive: true });
  const shoot = (page, what) => pictures && page.screenshot({ path: join(pictures, `${what}.png`) });
  const open = async (size, address) => {
    const page = await context.newPage();
    const faults = [];
    page.on("pageerror", (error) => faults.push(error));
    page.on("console", (told) => told.type() === "error" && faults.push(told.text()));
    await page.setViewportSize(size);
    await page.goto(`${server.url}/${address}`);
    return { page, faults };
  };
  const state = (page) => page.evaluate(() => ({ ...globalThis.unweld, drawn: { ...globalThis.unweld.drawn } }));

  const wide = await open({ width: 1280, height: 800 }, "");
  await wide.page.waitForFunction(() => globalThis.unweld.triangles > 0);
  const early = await state(wide.page);
  assert.ok(early.bytes < early.total, `the first triangles were there after ${early.bytes} of ${early.total} bytes`);
  await shoot(wide.page, "wide-early");
  await wide.page.waitForFunction(() => globalThis.unweld.complete, null, { timeout: 60_000 });
  await wide.page.waitForTimeout(600);
  const late = await state(wide.page);
  await shoot(wide.page, "wide-late");
  const shown = await wide.page.textContent("#triangles");
  assert.ok(late.triangles >= early.triangles && late.bytes === late.total);
  if (name === "sphere.uwm") assert.equal(shown, "80 / 80", "the sphere has 80 triangles");
  await wide.page.check("#edges");
  await wide.page.fill("#level", await wide.page.evaluate(() => String(Math.floor(document.getElementById("level").max / 2))));
  await wide.page.waitForFunction((most) => parseInt(document.getElementById("triangles").textContent.replaceAll(",", "")) < most, late.triangles);
  await wide.page.waitForTimeout(600);
  await shoot(wide.page, "wide-coarse");
  assert.deepEqual(wide.faults, []);

  const narrow = await open({ width: 390, height: 844 }, `?src=meshes/${name}`);
  await narrow.page.waitForFunction(() => globalThis.unweld.complete, null, { timeout: 60_000 });
  await narrow.page.waitForTimeout(600);
  const overflow = await narrow.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(overflow <= 0, "nothing is wider than a phone");
  await shoot(narrow.page, "narrow-late");
  assert.deepEqual(narrow.faults, []);

  const lost = await open({ width: 1280, height: 800 }, "?src=meshes/no.uwm");
  await lost.page.waitForFunction(() => document.getElementById("message").textContent.includes("404"));

  console.log(
    `${name}: first triangles after ${early.firstBytes} of ${early.total} bytes, ${late.triangles} in the end; ` +
      `${late.drawn.count} pictures; longest task ${Math.round(late.longestTask)} ms (0: none above 50), ` +
      `longest change of the geometry ${late.longestApply.toFixed(1)} ms`,
  );
} finally {
  await context.close();
  server.close();
  await rm(profile, { recursive: true, force: true });
}
