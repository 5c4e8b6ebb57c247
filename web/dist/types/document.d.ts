import type { Kind, PartSpec } from "./buffers.js";
import type { Contents } from "./types.js";
/** The name of the extension. */
export declare const NAME = "UNWELD_progressive_mesh";
/** Whatever has extensions; ours is known. */
interface Extensible<T> {
    extensions?: {
        [NAME]?: T;
    } & Record<string, unknown>;
}
export interface Primitive extends Extensible<{
    part: number;
    exponent?: number;
    attributes: Record<string, Kind>;
    targets?: Record<string, Kind>[];
}> {
    attributes?: Record<string, number>;
    targets?: Record<string, number>[];
}
export interface Image extends Extensible<{
    previews?: Preview[];
    uri?: string;
}> {
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
export interface Document extends Extensible<{
    bufferView?: number;
    uri?: string;
}> {
    meshes?: {
        primitives: Primitive[];
    }[];
    nodes?: {
        mesh?: number;
        skin?: number;
    }[];
    images?: Image[];
    textures?: {
        source?: number;
        extensions?: Record<string, {
            source?: number;
        }>;
    }[];
    materials?: {
        normalTexture?: {
            index: number;
        };
        emissiveTexture?: {
            index: number;
        };
    }[];
    bufferViews?: {
        buffer: number;
        byteOffset?: number;
        byteLength: number;
    }[];
    accessors?: Accessor[];
    animations?: {
        samplers: {
            input: number;
            output: number;
        }[];
        channels: {
            target: {
                node?: number;
            };
        }[];
    }[];
}
export interface Accessor {
    bufferView?: number;
    count: number;
    type: string;
    max?: number[];
    sparse?: {
        indices: {
            bufferView: number;
        };
        values: {
            bufferView: number;
        };
    };
}
/** Numbers of an item of an accessor. */
export declare function componentsOf(type: string): number;
/** The views of what does not stand right behind the base. */
export declare function lateViews({ bufferViews }: Document, { resources, levels }: Contents): Set<number>;
/** What each part has, by the primitives that show it. */
export declare function partsOf({ meshes, nodes }: Document): PartSpec[];
/** The image of a texture. */
export declare function imageOf({ textures }: Document, texture: number): number | undefined;
/** What there is of an image, the coarsest first: a view of binary data, and pixels along its longer side, `Infinity` for the image itself. */
export interface Version {
    readonly size: number;
    readonly view: number;
    readonly mimeType: string | undefined;
}
export declare function versionsOf({ bufferView, mimeType, extensions }: Image): Version[];
/** Of the binary data those that nobody wants who is content with so many pixels along the longer side of an image. */
export declare function unwanted(document: Document, pixels: number): number[];
export {};
