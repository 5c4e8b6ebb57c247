// What the stage shows: a mesh in the viewer's own material, or a scene in its own.

import { AnimationMixer, type Light, type Material, Mesh, type MeshStandardMaterial, type Object3D, type Sphere } from "three";
import type { UnweldGLTF } from "../gltf.js";
import type { Slide } from "../geomorph.js";
import type { UnweldGeometry } from "../three.js";

/** An object that refines. */
export interface Shown {
  readonly object: Object3D;
  /** Its own materials, or none: then it wears the stage's. */
  readonly materials: readonly Material[];
  readonly slide: Slide | null;
  /** Whether it brings light of its own. */
  readonly isLit: boolean;
  /** Its clips by name, and how it is moved: by seconds that have passed. */
  readonly clips: readonly string[];
  play(clip: number | null): void;
  move(seconds: number): void;
  sphere(): Sphere | null;
  clock(): number;
  lastBorn(): number;
  dispose(): void;
}

export function shownMesh(geometry: UnweldGeometry, material: Material): Shown {
  return {
    object: new Mesh(geometry, material),
    materials: [],
    slide: null,
    isLit: false,
    clips: [],
    play: () => {},
    move: () => {},
    sphere: () => geometry.boundingSphere,
    clock: () => geometry.clock(),
    lastBorn: () => geometry.lastBorn,
    dispose: () => geometry.dispose(),
  };
}

export function shownScene({ scene, animations, unweld }: UnweldGLTF): Shown {
  const materials = new Set<Material>();
  let isLit = false;
  scene.traverse((object) => {
    isLit ||= (object as Partial<Light>).isLight ?? false;
    for (const material of [(object as Partial<Mesh>).material ?? []].flat()) materials.add(material);
  });
  const mixer = new AnimationMixer(scene);
  return {
    object: scene,
    materials: [...materials],
    slide: unweld.slide,
    isLit,
    clips: animations.map(({ name }, k) => name || `animation ${k + 1}`),
    play: (clip) => {
      mixer.stopAllAction();
      if (clip !== null) mixer.clipAction(animations[clip]!).play();
    },
    move: (seconds) => void mixer.update(seconds),
    sphere: () => unweld.boundingSphere,
    clock: () => unweld.clock(),
    lastBorn: () => unweld.lastBorn,
    dispose: () => unweld.dispose(),
  };
}

/** Lines instead of surfaces, or one normal for each triangle: what a scene's materials were otherwise is kept beside. */
export function dress(materials: readonly Material[], lines: boolean, flat: boolean): void {
  for (const material of materials as MeshStandardMaterial[]) {
    const own = (material.userData.unweldFlat ??= material.flatShading ?? false) as boolean;
    if ("wireframe" in material) material.wireframe = lines;
    if (material.flatShading === (flat || own)) continue;
    material.flatShading = flat || own;
    material.needsUpdate = true;
  }
}
