// Chromium as tests and the benchmark start it: without a window, drawing in software, asking nobody for anything.

import { existsSync } from "node:fs";

/** Where it is, or `undefined`. */
export const chromium = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(
  (path) => path && existsSync(path),
);

export const ARGUMENTS = [
  ...["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"],
  ...["--disable-component-update", "--disable-sync", "--disable-gpu", "--enable-unsafe-swiftshader"],
];
