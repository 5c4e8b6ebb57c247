/** For glTF-Transform: reads and writes the extension `UNWELD_progressive_mesh`. */
import { ExtensionProperty, Extension, PropertyType, type IProperty, type Nullable, type ReaderContext, type WriterContext } from "@gltf-transform/core";
import type { Kind } from "./buffers.js";
import { NAME } from "./document.js";
interface MeshProperty extends IProperty {
    bytes: Uint8Array | null;
    uri: string;
}
/** The .uwm of a document, on its root: its bytes, which become a buffer view, or an address. */
export declare class ProgressiveMesh extends ExtensionProperty<MeshProperty> {
    static EXTENSION_NAME: string;
    extensionName: typeof NAME;
    propertyType: "ProgressiveMesh";
    parentTypes: [PropertyType.ROOT];
    protected init(): void;
    protected getDefaults(): Nullable<MeshProperty>;
    getBytes(): Uint8Array | null;
    setBytes(bytes: Uint8Array | null): this;
    getURI(): string;
    setURI(uri: string): this;
}
interface PartProperty extends IProperty {
    part: number;
    exponent: number;
    attributes: Record<string, Kind>;
    targets: {
        all: Record<string, Kind>[];
    };
}
/** The part of the .uwm that a primitive is. */
export declare class ProgressivePart extends ExtensionProperty<PartProperty> {
    static EXTENSION_NAME: string;
    extensionName: typeof NAME;
    propertyType: "ProgressivePart";
    parentTypes: [PropertyType.PRIMITIVE];
    protected init(): void;
    protected getDefaults(): Nullable<PartProperty>;
    getPart(): number;
    setPart(part: number): this;
    /** Positions in the .uwm are 2^exponent times those of the primitive. */
    getExponent(): number;
    setExponent(exponent: number): this;
    getAttributes(): Record<string, Kind>;
    setAttributes(attributes: Record<string, Kind>): this;
    getTargets(): Record<string, Kind>[];
    setTargets(targets: Record<string, Kind>[]): this;
}
/**
 * The extension: `new NodeIO().registerExtensions([UnweldProgressiveMesh])`.
 *
 * Whoever changes the geometry of a primitive takes its part away (`primitive.setExtension(NAME, null)`), for the .uwm would undo it.
 */
export declare class UnweldProgressiveMesh extends Extension {
    #private;
    static readonly EXTENSION_NAME = "UNWELD_progressive_mesh";
    readonly extensionName = "UNWELD_progressive_mesh";
    readonly prewriteTypes: PropertyType[];
    createMesh(): ProgressiveMesh;
    createPart(): ProgressivePart;
    read(context: ReaderContext): this;
    /** The bytes go into the document's first buffer. */
    prewrite(context: WriterContext): this;
    write(context: WriterContext): this;
}
export { NAME };
export type { Kind };
