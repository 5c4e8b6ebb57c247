import { EventDispatcher, Sphere } from "three";
import { type Document } from "./document.js";
import { type Slide } from "./geomorph.js";
import type { Contents, Delta, Level, MeshStream, Until } from "./unweld.js";
/** What `UnweldScene` dispatches. */
export interface SceneEvents {
    /** Geometries have changed. */
    refine: {
        delta: Delta;
    };
    /** An image has become finer: its number in the document, and pixels along its longer side. */
    texture: {
        image: number;
        size: number;
    };
    /** The samples of an animation have come, after the first picture: its number in the document. */
    animation: {
        animation: number;
    };
    /** All that is wanted is there, or a prefix has ended. */
    complete: object;
    /** It will not be. */
    error: {
        error: unknown;
    };
}
/** How a scene refines: `gltf.unweld`. */
export declare class UnweldScene extends EventDispatcher<SceneEvents> {
    #private;
    /** What the file holds, once known. */
    contents: Contents | null;
    /** Triangles of the mesh as it stands: each part once, however often it is shown. */
    triangles: number;
    /** The finest level that has arrived, or `null` before the base has. */
    finest: number | null;
    /** The delta applied last. */
    last: Delta | null;
    /** When vertices were appended last, on `clock`. */
    lastBorn: number;
    /** What a planner says of the level to come. */
    room: number | null;
    /** Of the whole scene as it stood when it was loaded, in the space of `gltf.scene`. */
    boundingSphere: Sphere | null;
    /** Uniforms of all its materials, where it is loaded with `morph`. */
    readonly slide: Slide;
    /** When all that is wanted first is there and shown, textures and animations too, or the prefix of a file has ended (`last.prefix`). */
    readonly complete: Promise<void>;
    /** Follows a stream. `document`: where the file does not hold one. */
    constructor(stream: MeshStream, { morph, document }: {
        morph?: boolean;
        document?: Document | null;
    });
    /** How far the surface jumped at most with the delta applied last, new vertices being where they begin. */
    get jump(): number;
    /** Bytes of all vertex and index buffers. */
    get bytes(): number;
    /** Bytes that a level takes, about: those of now, by its triangles. */
    bytesOf({ vertices, triangles }: Level): number;
    /** Seconds since loading began. */
    clock(): number;
    /** Shows a level that has arrived, or with `null` the finest; wants `UnweldGLTFLoader.levels`. */
    show(level: number | null): Promise<void>;
    /** Wants more or less of the file from now on; resolves when it is there. Only bytes that are missing are fetched. */
    want(until: Until): Promise<void>;
    /** Goes on after a `ConnectionError`; resolves when all that is wanted is there. */
    resume(): Promise<void>;
    /** Ends the stream and frees geometries and textures. */
    dispose(): void;
}
