/** For glTF-Transform: reads and writes the extension `UNWELD_progressive_mesh`. */

import { ExtensionProperty, Extension, PropertyType, type IProperty, type Nullable, type ReaderContext, type WriterContext } from "@gltf-transform/core";
import type { Kind } from "./buffers.js";
import { NAME, type Document, type Primitive } from "./document.js";

interface MeshProperty extends IProperty {
  bytes: Uint8Array | null;
  uri: string;
}

/** The .uwm of a document, on its root: its bytes, which become a buffer view, or an address. */
export class ProgressiveMesh extends ExtensionProperty<MeshProperty> {
  static override EXTENSION_NAME = NAME;
  declare extensionName: typeof NAME;
  declare propertyType: "ProgressiveMesh";
  declare parentTypes: [PropertyType.ROOT];

  protected override init(): void {
    Object.assign(this, { extensionName: NAME, propertyType: "ProgressiveMesh", parentTypes: [PropertyType.ROOT] });
  }

  protected override getDefaults(): Nullable<MeshProperty> {
    return Object.assign(super.getDefaults() as IProperty, { bytes: null, uri: "" });
  }

  getBytes(): Uint8Array | null {
    return this.get("bytes");
  }

  setBytes(bytes: Uint8Array | null): this {
    return this.set("bytes", bytes);
  }

  getURI(): string {
    return this.get("uri");
  }

  setURI(uri: string): this {
    return this.set("uri", uri);
  }
}

interface PartProperty extends IProperty {
  part: number;
  exponent: number;
  attributes: Record<string, Kind>;
  targets: { all: Record<string, Kind>[] };
}

/** The part of the .uwm that a primitive is. */
export class ProgressivePart extends ExtensionProperty<PartProperty> {
  static override EXTENSION_NAME = NAME;
  declare extensionName: typeof NAME;
  declare propertyType: "ProgressivePart";
  declare parentTypes: [PropertyType.PRIMITIVE];

  protected override init(): void {
    Object.assign(this, { extensionName: NAME, propertyType: "ProgressivePart", parentTypes: [PropertyType.PRIMITIVE] });
  }

  protected override getDefaults(): Nullable<PartProperty> {
    return Object.assign(super.getDefaults() as IProperty, { part: 0, exponent: 0, attributes: {}, targets: { all: [] } });
  }

  getPart(): number {
    return this.get("part");
  }

  setPart(part: number): this {
    return this.set("part", part);
  }

  /** Positions in the .uwm are 2^exponent times those of the primitive. */
  getExponent(): number {
    return this.get("exponent");
  }

  setExponent(exponent: number): this {
    return this.set("exponent", exponent);
  }

  getAttributes(): Record<string, Kind> {
    return this.get("attributes") as Record<string, Kind>;
  }

  setAttributes(attributes: Record<string, Kind>): this {
    return this.set("attributes", attributes as never);
  }

  getTargets(): Record<string, Kind>[] {
    return (this.get("targets") as unknown as PartProperty["targets"]).all;
  }

  setTargets(targets: Record<string, Kind>[]): this {
    return this.set("targets", { all: targets } as never);
  }
}

/**
 * The extension: `new NodeIO().registerExtensions([UnweldProgressiveMesh])`.
 *
 * Whoever changes the geometry of a primitive takes its part away (`primitive.setExtension(NAME, null)`), for the .uwm would undo it.
 */
export class UnweldProgressiveMesh extends Extension {
  static override readonly EXTENSION_NAME = NAME;
  override readonly extensionName = NAME;
  override readonly prewriteTypes = [PropertyType.BUFFER];

  createMesh(): ProgressiveMesh {
    return new ProgressiveMesh(this.document.getGraph());
  }

  createPart(): ProgressivePart {
    return new ProgressivePart(this.document.getGraph());
  }

  override read(context: ReaderContext): this {
    const document = context.jsonDoc.json as unknown as Document;
    const root = document.extensions?.[NAME];
    if (root) {
      const mesh = this.createMesh().setURI(root.uri ?? "");
      if (root.bufferView !== undefined) mesh.setBytes(context.bufferViews[root.bufferView]!.slice());
      this.document.getRoot().setExtension(NAME, mesh);
    }
    (document.meshes ?? []).forEach(({ primitives }, m) => {
      const made = context.meshes[m]!.listPrimitives();
      primitives.forEach(({ extensions }, p) => {
        const told = extensions?.[NAME];
        if (!told) return;
        const part = this.createPart().setPart(told.part).setExponent(told.exponent ?? 0).setAttributes(told.attributes);
        made[p]!.setExtension(NAME, part.setTargets(told.targets ?? []));
      });
    });
    return this;
  }

  /** The bytes go into the document's first buffer. */
  override prewrite(context: WriterContext): this {
    const bytes = this.#mesh()?.getBytes();
    if (!bytes) return this;
    const root = this.document.getRoot();
    const buffer = root.listBuffers()[0] ?? this.document.createBuffer();
    const views = context.otherBufferViews.get(buffer) ?? [];
    context.otherBufferViews.set(buffer, [...views, bytes]);
    return this;
  }

  override write(context: WriterContext): this {
    const document = context.jsonDoc.json as unknown as Document;
    const mesh = this.#mesh();
    if (mesh) {
      const bytes = mesh.getBytes();
      const bufferView = bytes ? context.otherBufferViewsIndexMap.get(bytes) : undefined;
      (document.extensions ??= {})[NAME] = bufferView === undefined ? { uri: mesh.getURI() } : { bufferView };
    }
    for (const made of this.document.getRoot().listMeshes()) {
      const { primitives } = document.meshes![context.meshIndexMap.get(made)!]!;
      made.listPrimitives().forEach((primitive, p) => {
        const part = primitive.getExtension<ProgressivePart>(NAME);
        if (!part) return;
        const told: NonNullable<Primitive["extensions"]>[typeof NAME] = { part: part.getPart(), exponent: part.getExponent(), attributes: part.getAttributes() };
        const targets = part.getTargets();
        if (targets.length > 0) told.targets = targets;
        (primitives[p]!.extensions ??= {})[NAME] = told;
      });
    }
    return this;
  }

  #mesh(): ProgressiveMesh | null {
    return this.document.getRoot().getExtension<ProgressiveMesh>(NAME);
  }
}

export { NAME };
export type { Kind };
