// Animations whose samples come late: there from the first, in the rest pose, and filled in place.

import { BufferAttribute, type AnimationClip, type Mesh, type Object3D } from "three";
import type { GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import { componentsOf, lateViews, type Accessor, type Document } from "./document.js";
import type { UnweldScene } from "./refining.js";

type Parser = GLTFParser & { loadAnimation(animation: number): Promise<AnimationClip> };

export class Motion {
  readonly #parser: Parser;
  readonly #document: Document;
  readonly #scene: UnweldScene;
  readonly #late: ReadonlySet<number>;

  constructor(parser: GLTFParser, document: Document, scene: UnweldScene) {
    this.#parser = parser as Parser;
    this.#document = document;
    this.#scene = scene;
    this.#late = lateViews(document, scene.contents!);
  }

  /** A clip that stands still until its samples have come; `null` where it need not wait for them. */
  load(animation: number): Promise<AnimationClip> | null {
    const { samplers } = this.#document.animations![animation]!;
    const accessors = new Set(samplers.flatMap(({ input, output }) => [input, output]));
    const views = [...accessors].flatMap((number) => viewsOf(this.#document.accessors![number]));
    if (!views.some((view) => this.#late.has(view))) return null;
    return this.#standing(animation).then((clip) => {
      const buffers = views.map((view) => this.#scene.buffer(this.#document.bufferViews![view]!.buffer));
      void Promise.all(buffers).then(() => this.#scene.busy(this.#fill(animation, clip)));
      return clip;
    });
  }

  /** What three.js makes of it, with accessors that are as long as they will be. */
  async #standing(animation: number): Promise<AnimationClip> {
    const parser = this.#parser;
    const own = parser.getDependency;
    parser.getDependency = (type, index) => (type === "accessor" ? Promise.resolve(this.#empty(index)) : own.call(parser, type, index));
    let made: Promise<AnimationClip>;
    try {
      // It asks for all that it wants before it waits.
      made = parser.loadAnimation(animation);
    } finally {
      parser.getDependency = own;
    }
    const [clip, objects] = [await made, new Map<string, Object3D>()];
    for (const { target } of this.#document.animations![animation]!.channels) {
      if (target.node === undefined) continue;
      const node = (await parser.getDependency("node", target.node)) as Object3D;
      node.traverse((object) => objects.set(object.name || object.uuid, object));
    }
    for (const track of clip.tracks) {
      const dot = track.name.lastIndexOf(".");
      const rest = restOf(objects.get(track.name.slice(0, dot)), track.name.slice(dot + 1));
      // An array of its own: another node may have the same samples, but has another rest.
      const values = (track.values = track.values.slice());
      const [each, isCubic] = [values.length / track.times.length, values.length === 3 * rest.length * track.times.length];
      for (let at = isCubic ? rest.length : 0; at < values.length; at += each) values.set(rest, at);
    }
    return clip;
  }

  #empty(number: number): BufferAttribute {
    const { count, type, max } = this.#document.accessors![number]!;
    const size = componentsOf(type);
    const array = new Float32Array(count * size);
    // Of times the last is known, and with it how long the animation is.
    if (size === 1 && max) array[count - 1] = max[0]!;
    return new BufferAttribute(array, size);
  }

  /** Samples take the place of the rest pose in the same arrays: whatever plays the clip goes on with them. */
  async #fill(animation: number, clip: AnimationClip): Promise<void> {
    const { tracks, duration } = await this.#parser.loadAnimation(animation);
    clip.tracks.forEach((track, k) => {
      const { times, values } = tracks[k]!;
      track.times.set(times.subarray(0, track.times.length));
      track.values.set(values.subarray(0, track.values.length));
    });
    clip.duration = duration;
    this.#scene.dispatchEvent({ type: "animation", animation });
  }
}

function viewsOf({ bufferView, sparse }: Accessor = { count: 0, type: "SCALAR" }): number[] {
  return [bufferView, sparse?.indices.bufferView, sparse?.values.bufferView].filter((view) => view !== undefined);
}

/** What a property has that nothing moves. */
function restOf(object: Object3D | undefined, property: string): readonly number[] {
  if (property === "morphTargetInfluences") return (object as Mesh | undefined)?.morphTargetInfluences ?? [0];
  const of = object?.[property as "position" | "quaternion" | "scale"];
  return of?.toArray() ?? (property === "quaternion" ? [0, 0, 0, 1] : property === "scale" ? [1, 1, 1] : [0, 0, 0]);
}
