// The glTF document of a scene: what the extension says in it.

import type { Kind, PartSpec } from "./buffers.js";
import type { Contents } from "./types.js";

/** The name of the extension. */
export const NAME = "UNWELD_progressive_mesh";

/** Whatever has extensions; ours is known. */
interface Extensible<T> {
  extensions?: { [NAME]?: T } & Record<string, unknown>;
}

export interface Primitive
  extends Extensible<{ part: number; exponent?: number; attributes: Record<string, Kind>; targets?: Record<string, Kind>[] }> {
  attributes?: Record<string, number>;
  targets?: Record<string, number>[];
}

export interface Image extends Extensible<{ previews?: Preview[]; uri?: string }> {
  bufferView?: number;
  mimeType?: string;
  uri?: string;
  extras?: unknown;
}

export interface Preview {
  size: number;
  bufferView: number;
  mimeType: string;
}

/** As much of glTF as is looked at here. */
export interface Document extends Extensible<{ bufferView?: number; uri?: string }> {
  meshes?: { primitives: Primitive[] }[];
  nodes?: { mesh?: number; skin?: number }[];
  images?: Image[];
  textures?: { source?: number; extensions?: Record<string, { source?: number }> }[];
  materials?: { normalTexture?: { index: number }; emissiveTexture?: { index: number } }[];
  bufferViews?: { buffer: number; byteOffset?: number; byteLength: number }[];
  accessors?: Accessor[];
  animations?: { samplers: { input: number; output: number }[]; channels: { target: { node?: number } }[] }[];
}

export interface Accessor {
  bufferView?: number;
  count: number;
  type: string;
  max?: number[];
  sparse?: { indices: { bufferView: number }; values: { bufferView: number } };
}

/** Numbers of an item of an accessor. */
export function componentsOf(type: string): number {
  return { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 }[type] ?? 1;
}

/** The views of what does not stand right behind the base. */
export function lateViews({ bufferViews = [] }: Document, { resources, levels }: Contents): Set<number> {
  const first = resources.findIndex(({ kind }) => kind === "buffer");
  const isLate = ({ buffer }: { buffer: number }) => (resources[first + buffer]?.level ?? 0) < levels.length - 1;
  return new Set(bufferViews.flatMap((view, k) => (isLate(view) ? [k] : [])));
}

/** What each part has, by the primitives that show it. */
export function partsOf({ meshes = [], nodes = [] }: Document): PartSpec[] {
  const skinned = new Set(nodes.filter(({ skin }) => skin !== undefined).map(({ mesh }) => mesh));
  const parts = new Map<number, PartSpec>();
  meshes.forEach(({ primitives }, mesh) => {
    for (const { extensions } of primitives) {
      const told = extensions?.[NAME];
      if (!told) continue;
      const { part, exponent = 0, attributes, targets = [] } = told;
      const alone = targets.length > 0 || skinned.has(mesh) || (parts.get(part)?.alone ?? false);
      parts.set(part, { part, exponent, attributes, targets, alone });
    }
  });
  return [...parts.values()];
}

/** The image of a texture. */
export function imageOf({ textures = [] }: Document, texture: number): number | undefined {
  const { source, extensions = {} } = textures[texture] ?? {};
  const [other] = Object.values(extensions).flatMap((extension) => (extension?.source === undefined ? [] : [extension.source]));
  return other ?? source;
}

/** What there is of an image, the coarsest first: a view of binary data, and pixels along its longer side, `Infinity` for the image itself. */
export interface Version {
  readonly size: number;
  readonly view: number;
  readonly mimeType: string | undefined;
}

export function versionsOf({ bufferView, mimeType, extensions }: Image): Version[] {
  const previews = [...(extensions?.[NAME]?.previews ?? [])].sort((a, b) => a.size - b.size);
  const versions: Version[] = previews.map(({ size, bufferView, mimeType }) => ({ size, view: bufferView, mimeType }));
  if (bufferView !== undefined) versions.push({ size: Infinity, view: bufferView, mimeType });
  return versions;
}

/** Of the binary data those that nobody wants who is content with so many pixels along the longer side of an image. */
export function unwanted(document: Document, pixels: number): number[] {
  const views = document.bufferViews ?? [];
  const buffers = (wanted: boolean) =>
    (document.images ?? []).flatMap((image) =>
      versionsOf(image).flatMap(({ size, view }, k) => ((size <= pixels || k === 0) === wanted ? [views[view]?.buffer ?? -1] : [])),
    );
  const wanted = new Set(buffers(true));
  return [...new Set(buffers(false))].filter((buffer) => buffer >= 0 && !wanted.has(buffer));
}
