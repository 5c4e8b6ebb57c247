/** What a file holds, as its header and table of contents tell. */
export interface Contents {
  /**
   * Whether the file is a set of meshes. Its members stand here as levels: each is a mesh of its own, which takes the place of the one before as a whole, and
   * errors are distances from member 0.
   */
  readonly set: boolean;
  /** Vertices of the finest level, without what the residue holds. */
  readonly vertices: number;
  /** Triangles of the finest level, without what the residue holds. */
  readonly triangles: number;
  /** Bits a coordinate of the lattice. */
  readonly bits: number;
  /** The distance of two lattice points, in the units of the input. */
  readonly step: number;
  /** The smallest corner of the bounding box, the origin of the lattice. */
  readonly min: readonly [number, number, number];
  /** The largest corner of the bounding box. */
  readonly max: readonly [number, number, number];
  /** The levels by number: 0 is the finest, the last is the base. */
  readonly levels: readonly Level[];
  /** Where header and table of contents end, in bytes. */
  readonly tableEnd: number;
  /** Bytes of the whole file. */
  readonly fileBytes: number;
  /** What will be decoded of it. `MeshStream.want` changes it. */
  readonly wanted: Wanted;
  /** The attributes of a vertex that deltas have. */
  readonly attributes: readonly { readonly name: string; readonly components: number }[];
  /** What else the file has at corners and triangles: `Delta.attributes` tells the values. */
  readonly fileAttributes: readonly FileAttribute[];
  /** Files beside the mesh, in their order: the glTF document of a scene, and its binary data. `Delta.resources` tells them. */
  readonly resources: readonly ResourceEntry[];
  /** Those of them, by number, that are wanted and were not while their bytes went by. */
  readonly lacking: readonly number[];
}

/** What will be decoded: its bytes are the first `end` of the file, but for `holes`, each from a byte to the one behind its last. */
export interface Wanted {
  readonly level: number;
  readonly vertices: number;
  readonly triangles: number;
  readonly end: number;
  readonly holes: readonly (readonly [number, number])[];
}

/** What the table of contents tells of a resource. */
export interface ResourceEntry {
  readonly kind: ResourceKind;
  /** The level behind which it stands. */
  readonly level: number;
  readonly bytes: number;
  /** Where in the file: the first byte, and the one behind the last. */
  readonly range: readonly [number, number];
}

/** `scene`: a glTF document; `buffer`: one of its buffers. */
export type ResourceKind = "scene" | "buffer";

/** A resource that is there as a whole. */
export interface Resource {
  readonly kind: ResourceKind;
  /** Its number among those of its kind: of the buffer in the document. */
  readonly number: number;
  readonly bytes: Uint8Array<ArrayBuffer>;
}

/** An attribute of a file, but for its values. */
export interface FileAttribute {
  /** What it is called here: `uv`, `uv1`, `normal`, `color`, `part` and so on, or the source's name; no two alike. */
  readonly name: string;
  readonly semantic: "normal" | "tangent" | "uv" | "color" | "joints" | "weights" | "part" | "generic";
  /** Which of several of the same semantic, from 0. */
  readonly set: number;
  /** Whether each corner has a value, and with it each wedge, or each triangle. */
  readonly domain: "corner" | "triangle";
  /** Numbers a value. */
  readonly components: number;
  /** The type of the numbers: that of the source, but binary32 for its binary64. */
  readonly type: NumberType;
  /** Whether integers stand for fractions: of 0 to 1, or of -1 to 1 where they have a sign. */
  readonly normalised: boolean;
  /** Whether some have no value: then the numbers are 0, of parts the largest of their type. */
  readonly partial: boolean;
  /** The coarsest level that has it: it is alive there and at all finer ones. */
  readonly level: number;
  /** Root mean square of what quantisation has lost, in the units of the values; of normals in degrees. */
  readonly error: number;
}

/** Types of numbers, in few letters. */
export type NumberType = "u8" | "i8" | "u16" | "i16" | "u32" | "i32" | "f32";

/** Numbers of an attribute, in an array of their type. */
export type Numbers = Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array | Float32Array;

/**
 * What is new of the attributes that are alive. A wedge is a vertex with one value of each attribute at corners, what a graphics card calls a vertex: where
 * texture coordinates have a seam, a vertex has several. Wedges are appended; each stays with its vertex and keeps its values.
 */
export interface Attributes {
  /** The names of those that are alive. Where none of these is at corners there are no wedges. */
  readonly alive: readonly string[];
  /**
   * The first triangle told, and all from it on. Where it is 0 everything is new, wedges too: attributes are born, or all of the mesh is new. Else it is
   * `Delta.firstTriangle`.
   */
  readonly firstTriangle: number;
  /** The first wedge told, and all from it on. */
  readonly firstWedge: number;
  /** The vertex of each wedge told. */
  readonly vertices: Uint32Array;
  /** The wedges of the triangles told, three a triangle. */
  readonly indices: Uint32Array;
  /** By name, values of the wedges told, or of the triangles told. */
  readonly values: Readonly<Record<string, Numbers>>;
  /** Of the triangles in `Delta.rewritten` the wedges, and by name the values of triangles; nothing where everything is new. */
  readonly rewritten: { readonly indices: Uint32Array; readonly values: Readonly<Record<string, Numbers>> };
}

/** A level of detail. */
export interface Level {
  readonly level: number;
  readonly vertices: number;
  readonly triangles: number;
  /** Largest distance of the input from its surface, in the units of the input. */
  readonly maxError: number;
  /** Root mean square distance of the input from its surface, in the units of the input. */
  readonly rmsError: number;
  /** How far its attributes are from the input's, of those that it has; nothing at level 0, where only quantisation loses anything. */
  readonly attributeErrors: readonly AttributeError[];
  /** The bytes of the file, from the first, that it takes; the finest with all that belongs to it: residue, exact coordinates, order, metadata. */
  readonly end: number;
}

/**
 * How far an attribute of a level is from that of the input: of normals and tangents an angle in degrees, of others a length in the units of the
 * attribute, where integers that stand for fractions count as these.
 */
export interface AttributeError {
  /** As in `Contents.fileAttributes`. */
  readonly name: string;
  /** Root mean square over the surface; of parts the share of the surface that has another part. */
  readonly error: number;
  /** What is not exceeded on 95 % of the surface; `null` of parts. */
  readonly high: number | null;
}

/** Values of single vertices: `values` has as many numbers for each of `vertices` as the attribute has components. */
export interface Changed {
  readonly vertices: Uint32Array;
  readonly values: Float32Array;
}

/** What has changed in the mesh since the delta before. Applied in order, deltas keep a copy of it; each copy is a valid mesh. */
export interface Delta {
  /** Vertices of the whole mesh now. */
  readonly vertices: number;
  /** Triangles of the whole mesh now. */
  readonly triangles: number;
  /** The first vertex appended. Where it is 0 everything is new: another level, or the file from its start again. */
  readonly firstVertex: number;
  /** By name of the attribute, the values of the vertices appended. */
  readonly appended: Readonly<Record<string, Float32Array>>;
  /** Where the vertices appended lay on the surface before: in the middle of the edge that was split. Three numbers a vertex. */
  readonly from: Float32Array;
  /**
   * How far the surface lies at most from the one before, while the vertices appended are still at `from`: 0 where no flip followed a
   * split and no vertex moved that was there. In the units of the input; 0 without the option `jumps`. What the residue adds is not counted.
   */
  readonly jump: number;
  /** By name of the attribute, values of vertices that were there: coarse levels' coordinates become sharper, and splits move the ends of edges. */
  readonly changed: Readonly<Record<string, Changed>>;
  /** The first triangle appended. */
  readonly firstTriangle: number;
  /** Vertices of the triangles appended, three a triangle. */
  readonly indices: Uint32Array;
  /** Triangles that were there and have other vertices now, and those. */
  readonly rewritten: { readonly triangles: Uint32Array; readonly indices: Uint32Array };
  /** What is new of the file's attributes, or `null`. Where `firstVertex` is 0 there are none but these. */
  readonly attributes: Attributes | null;
  /** The resources that have come, where they are wanted. */
  readonly resources: readonly Resource[];
  /** What the file holds. */
  readonly contents: Contents;
  /** The finest level that is complete, or `null` before the base is. */
  readonly level: Level | null;
  /** The levels that this delta completes. */
  readonly levels: readonly Level[];
  /** Bytes of the file decoded so far. */
  readonly bytes: number;
  /** What no manifold can hold, once it is part of the mesh. */
  readonly residue: Residue | null;
  /** Where the file comes from, once known. */
  readonly metadata: Metadata | null;
  /** Whether all that is wanted is there. */
  readonly complete: boolean;
  /** Whether what there is of the file has ended before that, as a prefix may: `level` is as fine as it gets. Told with the last delta. */
  readonly prefix: boolean;
  /** @internal Whether what follows is there already, so that a picture before it is not worth while. */
  readonly more: boolean;
}

/** How much the residue adds to the finest level. */
export interface Residue {
  readonly triangles: number;
  readonly vertices: number;
  readonly groups: number;
  readonly groupedVertices: number;
  readonly reversedTriangles: number;
}

/** Where a file comes from. */
export interface Metadata {
  readonly generator: string;
  readonly source: string;
  readonly settings: readonly (readonly [string, string])[];
  readonly dropped: readonly string[];
  readonly conditioning: readonly (readonly [string, number])[];
  readonly diagonal: number;
  /** Names of parts by number. */
  readonly partNames: readonly string[];
}

/** Which of a level's two errors is meant: `"max"` is `maxError`, `"rms"` is `rmsError`. */
export type Measure = "max" | "rms";

/** How far to decode: all where nothing is said, or by the first of these. No byte more than that takes is decoded. */
export interface Until {
  /** Down to this level; `Infinity` for the base alone. 0 is all, with what belongs to the finest level. */
  level?: number;
  /** Down to the coarsest level with at most this error, in the units of the input. */
  error?: number;
  /** Which error that is: the largest, where nothing is said, so that nothing lies farther off. */
  measure?: Measure;
  /** As long as there are at most so many triangles, those of the residue left out. */
  triangles?: number;
  /** Beside these: of an image that has previews only those of at most so many pixels along the longer side, or the smallest, and not the image itself. */
  textures?: number;
}

/** Settings of a decoder. */
export interface Settings {
  until?: Until;
  /** Positions relative to `contents.min`: for meshes far from the origin, which binary32 would blur. */
  relative?: boolean;
  /** Whether `show` will be used: it takes some 40 bytes a vertex more. */
  levels?: boolean;
  /** Whether `jump` is wanted. */
  jumps?: boolean;
  /** Whether resources are wanted: the document and the binary data of a scene. Without it they are not fetched. */
  resources?: boolean;
  /** Whether normals of the file are enough where it has them at every corner: those that triangles make are 0 then. */
  ownNormals?: boolean;
  /** Numbers that a delta holds at most, about: 800,000 at most. Who takes long to apply them wants fewer at a time. */
  most?: number;
  /** Where `unweld.wasm` is, if not beside the script. */
  wasm?: string | URL;
}
