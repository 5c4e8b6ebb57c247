// The viewer: a list of meshes (GET meshes, or ?src=ADDRESS), one of them as it arrives, and how far it is.

import { ConnectionError } from "../errors.js";
import { decode, type DecodeOptions } from "../decode.js";
import { UnweldGLTFLoader, type UnweldScene } from "../gltf.js";
import { UnweldGeometry } from "../three.js";
import type { Delta } from "../types.js";
import { lineOf } from "./line.js";
import { Stage } from "./stage.js";
import { Timeline } from "./timeline.js";

const element = <T extends HTMLElement = HTMLElement>(id: string) => document.getElementById(id) as T;
const [panel, message, meshes] = [document.querySelector("main")!, element("message"), element<HTMLSelectElement>("meshes")];
const slider = element<HTMLInputElement>("level");
const clips = element<HTMLSelectElement>("clip");
const members = element<HTMLSelectElement>("member");
const line = element<HTMLSelectElement>("line");
const stage = new Stage(element<HTMLCanvasElement>("view"));
const timeline = new Timeline(element<HTMLCanvasElement>("timeline"));
const loader = new UnweldGLTFLoader();
loader.morph = true;
/** Headers of all requests. */
let headers: HeadersInit = {};
let controller = new AbortController();

let geometry: UnweldGeometry | UnweldScene | null = null;
let current = "";
/** The level chosen, `null` for whatever is the finest. */
let chosen: number | null = null;
let showing = false;
/** What tells the file from another. */
let known = "";

/** For tests and the curious. */
const state = { triangles: 0, bytes: 0, total: 0, complete: false, firstBytes: 0, longestTask: 0, longestApply: 0, textures: 0, drawn: stage.drawn };
Object.assign(globalThis, { unweld: state });
if (PerformanceObserver.supportedEntryTypes.includes("longtask")) {
  new PerformanceObserver((list) => {
    for (const { duration } of list.getEntries()) state.longestTask = Math.max(state.longestTask, duration);
  }).observe({ type: "longtask" });
}
new PerformanceObserver((list) => {
  for (const { duration } of list.getEntriesByName("unweld")) state.longestApply = Math.max(state.longestApply, duration);
}).observe({ type: "measure" });

function load(address: string): void {
  current = address;
  controller.abort();
  controller = new AbortController();
  [geometry, chosen, known] = [null, null, ""];
  Object.assign(state, { triangles: 0, bytes: 0, total: 0, complete: false, firstBytes: 0, textures: 0 });
  say("");
  slider.disabled = true;
  element("playing").hidden = element("members").hidden = true;
  for (const id of ["triangles", "bytes", "rms", "max"]) element(id).textContent = "–";
  members.replaceChildren();
  timeline.begin();
  begun(address, controller.signal).catch((error: unknown) => {
    if (address === current && !(error instanceof DOMException && error.name === "AbortError")) failed(error);
  });
}

/** A mesh or a scene, as the file has it; ends when all of it is there. */
async function begun(address: string, signal: AbortSignal): Promise<void> {
  const options: DecodeOptions = {
    ...{ relative: true, levels: true, jumps: true, resources: true, prefix: true, signal },
    fetch: lineOf(() => Number(line.value)),
    // A lost connection is told after three attempts; then it is the reader who tries again.
    retries: 2,
    request: { headers },
  };
  const stream = decode(address, options);
  const contents = await stream.peek();
  if (contents?.resources.some(({ kind }) => kind === "scene")) {
    const gltf = await loader.follow(stream, address);
    if (address !== current || signal.aborted) return gltf.unweld.dispose();
    geometry = gltf.unweld;
    stage.showScene(gltf);
    refined(geometry.last!);
    geometry.addEventListener("refine", ({ delta }) => gltf.unweld === geometry && refined(delta));
    geometry.addEventListener("texture", () => {
      state.textures++;
      stage.draw();
    });
    element("playing").hidden = stage.clips.length === 0;
    clips.replaceChildren(new Option("still", ""), ...stage.clips.map((name, k) => new Option(name, String(k))));
    return geometry.complete;
  }
  const mesh = new UnweldGeometry(stream, { morph: true });
  mesh.addEventListener("refine", ({ delta }) => {
    if (address !== current || signal.aborted) return mesh.dispose();
    if (mesh === geometry) return refined(delta);
    if (!delta.level) return;
    geometry = mesh;
    stage.show(mesh);
    refined(delta);
  });
  return mesh.complete;
}

function refined(delta: Delta): void {
  const { contents, level, triangles, bytes } = delta;
  const total = contents.wanted;
  const told = JSON.stringify([contents.fileBytes, contents.vertices, contents.min, contents.max]);
  if (known && told !== known) {
    // The file has become another one and begins anew.
    [state.triangles, state.firstBytes, chosen] = [0, 0, null];
    timeline.begin();
    stage.fit();
  }
  known = told;
  const arrived = { bytes, triangles: Math.max(state.triangles, triangles) };
  Object.assign(state, { ...arrived, total: total.end, complete: delta.complete });
  if (!state.firstBytes && triangles > 0) state.firstBytes = bytes;
  element("triangles").textContent = `${triangles.toLocaleString("en")} / ${Math.max(triangles, total.triangles).toLocaleString("en")}`;
  element("bytes").textContent = `${sizeOf(bytes)} / ${sizeOf(total.end)}`;
  element("rms").textContent = level ? errorOf(level.rmsError, delta) : "–";
  element("max").textContent = level ? errorOf(level.maxError, delta) : "–";
  slider.max = String(contents.levels.length - 1);
  slider.disabled = false;
  element<HTMLInputElement>("checker").disabled = geometry instanceof UnweldGeometry === false || !contents.fileAttributes.some(({ name }) => name === "uv");
  if (chosen === null && level) slider.value = String(contents.levels.length - 1 - level.level);
  const kind = contents.set ? "member" : "level";
  element("levelName").textContent = level ? `${kind} ${level.level}` : kind;
  if (contents.set) list(delta);
  if (chosen === null) timeline.add({ ...arrived, levels: delta.levels.length }, { bytes: total.end, triangles: total.triangles });
  element("legend").textContent =
    chosen !== null && !delta.complete && !delta.prefix
      ? `a coarser ${kind} is shown; decoding rests`
      : timeline.words(delta.complete) + (delta.prefix ? `; a prefix of the file, down to level ${geometry?.finest}` : "");
  arrange();
}

/** The members of a set, to choose from those that have arrived. */
function list({ contents, level }: Delta): void {
  if (members.childElementCount !== contents.levels.length) {
    members.replaceChildren(...contents.levels.map(({ level, triangles }) => new Option(`${level} · ${triangles.toLocaleString("en")} triangles`, String(level))));
  }
  for (const option of members.options) option.disabled = Number(option.value) < (geometry?.finest ?? Infinity);
  if (level) members.value = String(level.level);
  element("members").hidden = false;
}

/** Shows the level that the slider stands at; at what has arrived last, whatever comes. */
async function show(): Promise<void> {
  const at = geometry?.contents;
  if (!at || !geometry) return;
  const wanted = at.levels.length - 1 - Number(slider.value);
  chosen = wanted <= (geometry.finest ?? 0) ? null : wanted;
  if (showing) return;
  showing = true;
  try {
    for (let shown; shown !== chosen; ) await geometry.show((shown = chosen));
  } finally {
    showing = false;
  }
}

function failed(error: unknown): void {
  say(error instanceof Error ? error.message : String(error));
  if (!(error instanceof ConnectionError)) return;
  const stopped = geometry;
  say(`The connection was lost after ${sizeOf(error.received)}${stopped ? "; what is shown stays" : ""}. `);
  const again = document.createElement("button");
  again.type = "button";
  again.textContent = "go on";
  again.onclick = () => {
    say("");
    if (!stopped) load(current);
    else stopped.resume().catch((error: unknown) => stopped === geometry && failed(error));
  };
  message.append(again);
}

function say(text: string): void {
  message.textContent = text;
  message.hidden = !text;
  arrange();
}

/** The mesh stands in the middle of what the panel leaves. */
let before = "";
function arrange(): void {
  const { right, top, height } = panel.getBoundingClientRect();
  const insets = innerWidth > 600 ? [innerWidth > 900 ? right : 0, 0] : [0, innerHeight - top || height];
  if (String(insets) === before) return;
  before = String(insets);
  stage.inset(insets[0]!, insets[1]!);
}

function sizeOf(bytes: number): string {
  if (bytes < 1000) return `${bytes} B`;
  return bytes < 1e6 ? `${(bytes / 1e3).toPrecision(3)} kB` : `${(bytes / 1e6).toPrecision(3)} MB`;
}

function errorOf(error: number, { contents }: Delta): string {
  const diagonal = Math.hypot(...contents.max.map((x, k) => x - contents.min[k]!));
  return diagonal > 0 ? `${((100 * error) / diagonal).toPrecision(2)} %` : String(error);
}

/** What GET meshes tells of a mesh or a set: at least its name; `error` where it cannot be read. */
interface Listed {
  name: string;
  triangles?: number;
  members?: { triangles: number }[];
  error?: string;
}

/** All meshes of the server, or the status of its refusal; 0 where there is no answer. */
async function listed(): Promise<Listed[] | number> {
  const list: Listed[] = [];
  for (let after: string | null = ""; after !== null && list.length < 10_000; ) {
    const query: string = after ? `?after=${encodeURIComponent(after)}` : "";
    const accepted = { Accept: "application/json", ...headers };
    const response: Response | null = await fetch(`meshes${query}`, { headers: accepted }).catch(() => null);
    if (!response?.ok) return list.length > 0 ? list : (response?.status ?? 0);
    const page: { meshes: Listed[]; next?: string | null } = await response.json();
    list.push(...page.meshes);
    // A page without a mesh would lead on for ever.
    after = page.meshes.length > 0 ? (page.next ?? null) : null;
  }
  return list;
}

async function begin(): Promise<void> {
  const source = new URLSearchParams(location.search).get("src");
  if (source) {
    element("name").textContent = source.split("/").at(-1) ?? source;
    return load(source);
  }
  // Nobody else gets the token: an address in `src` may be anyone's.
  const token = sessionStorage.getItem("token");
  if (token) headers = { Authorization: `Bearer ${token}` };
  const list = await listed();
  element("entry").hidden = list !== 401;
  if (list === 401) return say(token ? "This token is not known here." : "This server wants a token.");
  say("");
  if (!Array.isArray(list)) return say("There is no list of meshes here. Add ?src=ADDRESS of a .uwm file.");
  if (list.every(({ error }) => error)) return say(list[0] ? `${list[0].name}: ${list[0].error}` : "The list of meshes is empty.");
  const option = ({ name, members, triangles = members?.at(-1)?.triangles, error }: Listed) => {
    const text = error ? `${name} · ${error}` : triangles ? `${name} · ${triangles.toLocaleString("en")}` : name;
    const made = new Option(text, `meshes/${name.split("/").map(encodeURIComponent).join("/")}`);
    made.disabled = Boolean(error);
    return made;
  };
  meshes.replaceChildren(...list.map(option));
  meshes.hidden = false;
  element("name").hidden = true;
  meshes.onchange = () => load(meshes.value);
  load(meshes.value);
}

clips.onchange = () => stage.play(clips.value === "" ? null : Number(clips.value));
members.onchange = () => {
  slider.value = String(Number(slider.max) - Number(members.value));
  void show().catch(failed);
};
slider.oninput = () => void show().catch(failed);
for (const name of ["edges", "flat", "slide", "checker"] as const) {
  const box = element<HTMLInputElement>(name);
  box.onchange = () => stage[name](box.checked);
  stage[name](box.checked);
}
element("again").onclick = () => current && load(current);
// What is there already is quick however slow the line: it is seen from the beginning.
line.onchange = () => current && load(current);
element("entry").onsubmit = (event) => {
  event.preventDefault();
  sessionStorage.setItem("token", element<HTMLInputElement>("token").value);
  begin().catch(failed);
};
addEventListener("resize", arrange);
begin().catch(failed);
