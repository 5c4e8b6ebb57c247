// Which of several meshes gets the next bytes, and how far each goes: from their tables of contents and from where they are on the screen.
//
// 1. Every level of every mesh has an error in pixels: its largest error, times the pixels that a unit of length takes where the mesh is
//    nearest. The goal of a mesh is its coarsest level within the tolerance. The largest error is the default because then the tolerance
//    is a promise: nothing on the screen is farther off. With `measure: "rms"` it is the root mean square, which takes fewer bytes where
//    a level is far off in a few places only.
// 2. A mesh that has a goal keeps it while that is between its coarsest levels within the tolerance and within `slack` of the tolerance: so
//    small moves of the camera do not make it go up and down. A mesh out of view keeps what it shows, and gets no bytes.
// 3. If the goals together take more memory than the budget, meshes out of view go down to their bases; if that is not enough, the tolerance
//    is raised, for all alike, to the smallest one with which they fit. So the largest error on the screen is as small as the budget lets
//    it be. Bases always stay.
// 4. Meshes whose goal has not arrived are read a turn each, `lanes` of them at a time: whoever has a turn finishes it; the next goes to a
//    mesh that shows nothing yet, in their order, then to the one with the largest error in pixels. A turn ends with the first
//    level that is `segment` bytes further on; where nobody waits it goes all the way.
// 5. A mesh that has more than its goal shows its goal.

import type { Level, Measure } from "./types.js";

/** What the planner wants to know of a mesh. */
export interface Standing {
  /** Its levels by number, from the table of contents; `null` before that is known. */
  readonly levels: readonly Level[] | null;
  /** Pixels that a unit of length takes on the screen, where the mesh is nearest; 0 out of view. */
  readonly scale: number;
  /** The finest level that has arrived, `null` before the base has. */
  readonly arrived: number | null;
  /** The finest level that there is to be had, where the file has ended as a prefix. */
  readonly last?: number;
  /** Its goal as it was decided last, `null` if it never was. */
  readonly goal: number | null;
  /** The level that it is read up to now, `null` where it is not read. */
  readonly turn: number | null;
}

/** What the planner goes by. */
export interface Rules {
  /** The largest error on the screen that is good enough, in pixels. */
  readonly pixels: number;
  /** Which error of a level that is; `"max"` where nothing is said. */
  readonly measure?: Measure;
  /** A mesh goes down when a coarser level has at most this share of that error; from 0 to 1. */
  readonly slack: number;
  /** Bytes of all geometries together. */
  readonly budget: number;
  /** How many meshes are read at a time. */
  readonly lanes: number;
  /** Bytes that a turn takes at least, if there are so many. */
  readonly segment: number;
  /** Bytes of a geometry at a level. */
  readonly bytesOf: (level: Level) => number;
}

/** What is decided for a mesh. */
export interface Step {
  /** The level it is to show in the end, `null` before its table of contents is known. */
  readonly goal: number | null;
  /** The level to show instead of the finest that has arrived, `null` for that. */
  readonly show: number | null;
  /** The level to read up to now, `Infinity` for the base, `null` to rest. */
  readonly read: number | null;
}

/** What is decided for all of them. */
export interface Decision {
  /** By mesh, in their order. */
  readonly steps: Step[];
  /** The tolerance that the budget allows: `Infinity` where not even it does. */
  readonly pixels: number;
  /** Bytes of all geometries at their goals. */
  readonly bytes: number;
}

/** Decides. It remembers nothing: goals and turns are given back to it. */
export function decide(meshes: readonly Standing[], rules: Rules): Decision {
  const { goals, pixels, bytes } = goalsOf(meshes, rules);
  const reads = turns(meshes, goals, rules);
  const steps = meshes.map(({ arrived }, k): Step => {
    const goal = goals[k]!;
    const show = goal !== null && arrived !== null && arrived < goal ? goal : null;
    return { goal, show, read: reads[k]! };
  });
  return { steps, pixels, bytes };
}

/** The coarsest level with at most this error in the units of the mesh; 0 where none is so close. */
export function levelWithin(levels: readonly Level[], error: number, measure: Measure = "max"): number {
  for (let j = levels.length - 1; j > 0; j--) if (errorOf(levels[j]!, measure) <= error) return j;
  return 0;
}

/** One of the errors of a level. */
export function errorOf({ maxError, rmsError }: Level, measure: Measure = "max"): number {
  return measure === "rms" ? rmsError : maxError;
}

function goalsOf(meshes: readonly Standing[], rules: Rules): { goals: (number | null)[]; pixels: number; bytes: number } {
  const base = ({ levels }: Standing) => levels!.length - 1;
  const goalsAt = (pixels: number, keep: boolean) =>
    meshes.map((mesh) => {
      const { levels, scale, arrived, goal } = mesh;
      if (!levels) return null;
      if (scale <= 0) return keep ? Math.max(arrived ?? base(mesh), goal ?? 0) : base(mesh);
      const [coarsest, finest] = [pixels, rules.slack * pixels].map((error) => levelWithin(levels, error / scale, rules.measure));
      const wished = goal === null ? coarsest! : Math.min(coarsest!, Math.max(finest!, goal));
      return Math.max(wished, mesh.last ?? 0);
    });
  const bytesOf = (goals: (number | null)[]) =>
    goals.reduce<number>((sum, goal, k) => sum + (goal === null ? 0 : rules.bytesOf(meshes[k]!.levels![goal]!)), 0);
  const told = (pixels: number, goals: (number | null)[]) => ({ goals, pixels, bytes: bytesOf(goals) });

  const wished = told(rules.pixels, goalsAt(rules.pixels, true));
  if (wished.bytes <= rules.budget) return wished;
  const seen = told(rules.pixels, goalsAt(rules.pixels, false));
  if (seen.bytes <= rules.budget) return seen;
  // Goals change where a level comes within the tolerance, or within its slack; memory shrinks as it grows.
  const thresholds = meshes
    .flatMap(({ levels, scale }) => (levels && scale > 0 ? levels.map((level) => errorOf(level, rules.measure) * scale) : []))
    .flatMap((error) => (rules.slack > 0 ? [error, error / rules.slack] : [error]))
    .map((error) => error * (1 + ROUNDING))
    .filter((error) => error > rules.pixels)
    .sort((a, b) => a - b);
  let [low, high] = [0, thresholds.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (bytesOf(goalsAt(thresholds[middle]!, false)) <= rules.budget) high = middle;
    else low = middle + 1;
  }
  return told(thresholds[low] ?? Infinity, goalsAt(thresholds[low] ?? Infinity, false));
}

function turns(meshes: readonly Standing[], goals: readonly (number | null)[], rules: Rules): (number | null)[] {
  const reads: (number | null)[] = meshes.map(() => null);
  const needy = meshes.flatMap((mesh, k) => {
    if (mesh.arrived === null) return mesh.scale > 0 || !mesh.levels ? [{ k, mesh, error: Infinity }] : [];
    if (mesh.scale <= 0 || mesh.arrived <= goals[k]!) return [];
    return [{ k, mesh, error: errorOf(mesh.levels![mesh.arrived]!, rules.measure) * mesh.scale }];
  });
  // A turn under way, of those that are to go on at all.
  const isReading = ({ mesh: { arrived, turn } }: (typeof needy)[number]) => turn !== null && (arrived === null || arrived > turn);
  const order = needy.sort((a, b) => Number(isReading(b)) - Number(isReading(a)) || (a.error === b.error ? a.k - b.k : b.error - a.error));
  const alone = needy.length <= rules.lanes;
  for (const one of order.slice(0, rules.lanes)) {
    const { k, mesh } = one;
    const goal = goals[k] ?? null;
    if (mesh.arrived === null || goal === null) reads[k] = Infinity;
    else if (isReading(one) && !alone) reads[k] = Math.max(mesh.turn!, goal);
    else if (alone) reads[k] = goal;
    else {
      const levels = mesh.levels!;
      const enough = levels[mesh.arrived]!.end + rules.segment;
      let next = mesh.arrived - 1;
      while (next > goal && levels[next]!.end < enough) next--;
      reads[k] = next;
    }
  }
  return reads;
}

/** So that an error is within itself, divided and multiplied again. */
const ROUNDING = 1e-9;
