// Several meshes in one scene of three.js: bytes go to the one that is worst on the screen.

import { Frustum, Matrix4, Sphere, Vector3, type Camera, type Mesh, type Object3D } from "three";
import { checkNames } from "./checks.js";
import type { UnweldGeometry } from "./geometry.js";
import { decide, errorOf, levelWithin, type Decision, type Measure, type Rules, type Standing, type Step } from "./unweld.js";

/**
 * Pixels that a unit of length in the space of an object takes on the screen, where the object's bounding sphere is nearest to the camera;
 * 0 where it is not in view. `height`: of the picture, in pixels. World matrices are taken as they are.
 */
export function pixelsPerUnit(object: Object3D, sphere: Sphere, camera: Camera, height: number): number {
  const scale = object.matrixWorld.getMaxScaleOnAxis();
  const world = sphere.clone().applyMatrix4(object.matrixWorld);
  const projection = matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  const planes = frustum.setFromProjectionMatrix(projection, camera.coordinateSystem, camera.reversedDepth);
  if (!object.visible || !planes.intersectsSphere(world)) return 0;
  const upright = camera.projectionMatrix.elements;
  const size = (upright[5]! * height) / 2;
  // An orthographic camera sees all as large.
  if (upright[15] === 1) return scale * size;
  const distance = world.center.distanceTo(eye.setFromMatrixPosition(camera.matrixWorld)) - world.radius;
  return (scale * size) / Math.max(distance, NEAREST * world.radius, Number.MIN_VALUE);
}

/** The error in pixels of what a mesh shows now, its largest or by another measure; `Infinity` while nothing is shown, 0 out of view. */
export function pixelError(mesh: Mesh<UnweldGeometry>, camera: Camera, height: number, measure?: Measure): number {
  const { geometry } = mesh;
  if (!geometry.boundingSphere || !geometry.last?.level) return Infinity;
  return errorOf(geometry.last.level, measure) * pixelsPerUnit(mesh, geometry.boundingSphere, camera, height);
}

/**
 * The coarsest level of a mesh whose error is at most so many pixels, for `geometry.want`; `null` before its table of contents is known. With
 * `slack` below 1 it goes down from the level wanted last only to one of at most this share of the error.
 */
export function levelFor(
  mesh: Mesh<UnweldGeometry>,
  camera: Camera,
  height: number,
  pixels = 1,
  slack = 0.7,
  measure?: Measure,
): number | null {
  const { contents, boundingSphere } = mesh.geometry;
  if (!contents || !boundingSphere) return null;
  const scale = pixelsPerUnit(mesh, boundingSphere, camera, height);
  if (scale <= 0) return contents.wanted.level;
  const [coarsest, finest] = [pixels, slack * pixels].map((error) => levelWithin(contents.levels, error / scale, measure));
  return Math.min(coarsest!, Math.max(finest!, contents.wanted.level));
}

/** What a planner wants of a geometry, or of all of a scene: `gltf.unweld`. */
export type Refinable = Pick<UnweldGeometry, "contents" | "boundingSphere" | "finest" | "last" | "room" | "show" | "want" | "bytesOf">;

/** What is seen of it. */
export type Refined = Object3D;

/** A mesh with a planner. */
interface Planned {
  readonly mesh: Refined;
  readonly geometry: Refinable;
  step: Step;
  /** What has been asked of the geometry comes one after the other. */
  queue: Promise<unknown>;
  shown: number | null;
  error: unknown;
}

/**
 * Lets several meshes share line and memory. Their geometries come from `UnweldLoader.open`.
 *
 * ```js
 * const planner = new UnweldPlanner({ pixels: 1, budget: 200e6 });
 * for (const url of urls) {
 *   const mesh = new Mesh(loader.open(url), material);
 *   scene.add(mesh);
 *   planner.add(mesh);
 * }
 * // before each picture, or when something has moved:
 * planner.update(camera, renderer.domElement.height);
 * ```
 *
 * How it decides stands at `decide`. The budget is that of attributes and indices; the decoders in the workers have memory of their own,
 * which they give back only when a geometry is disposed of.
 */
export class UnweldPlanner {
  /** The largest error that is good enough, in pixels. */
  pixels: number;
  /** Bytes of all geometries together. */
  budget: number;
  /** Which error of a level that is: the largest, where nothing is said. */
  measure: Measure;
  slack: number;
  lanes: number;
  segment: number;
  /** What was decided last. */
  last: Decision | null = null;
  /** Called when a mesh cannot be read on; one whose connection was lost goes on with `retry`. */
  onError: (mesh: Refined, error: unknown) => void = () => {};
  readonly #planned: Planned[] = [];
  #view: [Camera, number] | null = null;

  constructor(rules: Partial<Omit<Rules, "bytesOf">> = {}) {
    checkNames("UnweldPlanner", rules, RULES);
    this.pixels = rules.pixels ?? 1;
    this.budget = rules.budget ?? 256e6;
    this.measure = rules.measure ?? "max";
    this.slack = rules.slack ?? 0.7;
    this.lanes = rules.lanes ?? 2;
    this.segment = rules.segment ?? 65_536;
  }

  /** Takes up a mesh with its geometry, or a scene with what refines it: `add(gltf.scene, gltf.unweld)`. */
  add(mesh: Mesh<UnweldGeometry>): this;
  add(scene: Object3D, refinable: Refinable): this;
  add(mesh: Refined, geometry: Refinable = (mesh as Mesh<UnweldGeometry>).geometry): this {
    const step: Step = { goal: null, show: null, read: null };
    this.#planned.push({ mesh, geometry, step, queue: Promise.resolve(), shown: null, error: null });
    return this;
  }

  /** Lets go of a mesh, as it is. */
  remove(mesh: Refined): this {
    const place = this.#planned.findIndex((planned) => planned.mesh === mesh);
    if (place >= 0) this.#planned.splice(place, 1);
    return this;
  }

  /** Decides anew: `height` of the picture in pixels. Between calls it goes on by itself with what it saw last. */
  update(camera: Camera, height: number): Decision {
    this.#view = [camera, height];
    const planned = this.#planned.filter(({ error }) => error === null);
    const owners = new Map(planned.flatMap(({ geometry }) => (geometry.contents?.levels ?? []).map((level) => [level, geometry] as const)));
    const decision = decide(
      planned.map((one) => this.#standing(one, camera, height)),
      { ...this, bytesOf: (level) => owners.get(level)?.bytesOf(level) ?? 0 },
    );
    planned.forEach((one, k) => this.#carryOut(one, decision.steps[k]!));
    return (this.last = decision);
  }

  /** Takes up those again that were lost. */
  retry(): void {
    for (const one of this.#planned) {
      if (one.error === null) continue;
      one.error = null;
      one.step = { ...one.step, read: null };
    }
    this.#again();
  }

  #standing({ mesh, geometry, step }: Planned, camera: Camera, height: number): Standing {
    const { contents, boundingSphere, finest } = geometry;
    const scale = boundingSphere ? pixelsPerUnit(mesh, boundingSphere, camera, height) : 0;
    const last = geometry.last?.prefix ? (finest ?? 0) : 0;
    return { levels: contents?.levels ?? null, scale, arrived: finest, last, goal: step.goal, turn: step.read };
  }

  #carryOut(one: Planned, step: Step): void {
    const { geometry } = one;
    const before = one.step;
    one.step = step;
    geometry.room = step.goal;
    if (step.show !== before.show) {
      this.#after(one, async () => {
        if (one.step.show === step.show && one.shown !== step.show) await geometry.show((one.shown = step.show));
      });
    }
    if (step.read === before.read) return;
    // Where a turn ends early, what is wanted is what there is.
    const level = step.read ?? geometry.finest;
    if (level === null) return;
    this.#after(one, () => {
      const reached = geometry.want({ level }).then(() => {
        if (one.step.read === level) one.step = { ...one.step, read: null };
      });
      reached.then(() => this.#again(), (error: unknown) => this.#failed(one, error));
    });
  }

  #after(one: Planned, act: () => unknown): void {
    one.queue = one.queue.then(act).catch((error: unknown) => this.#failed(one, error));
  }

  #failed(one: Planned, error: unknown): void {
    if (one.error !== null) return;
    one.error = error;
    if (this.#planned.includes(one)) this.onError(one.mesh, error);
    this.#again();
  }

  #again(): void {
    if (this.#view) this.update(...this.#view);
  }
}

/** The names of what a planner goes by. */
const RULES = Object.keys({
  pixels: true,
  budget: true,
  measure: true,
  slack: true,
  lanes: true,
  segment: true,
} satisfies Record<keyof Omit<Rules, "bytesOf">, true>);
const [frustum, matrix, eye] = [new Frustum(), new Matrix4(), new Vector3()];
/** Inside its bounding sphere a mesh is taken to be as near as this share of its radius. */
const NEAREST = 0.01;
