// The planner, with expected values worked out by hand. `node --test web/tests`

import assert from "node:assert/strict";
import { test } from "node:test";
import { decide, levelWithin } from "../dist/unweld.js";

/** Levels by number with these errors; level j has 100 bytes of geometry for each step above the base, and ends at as many thousand bytes. */
const levelsOf = (...errors) =>
  errors.map((maxError, level) => {
    const size = errors.length - level;
    return { level, maxError, rmsError: maxError / 3, vertices: size, triangles: 2 * size, end: 1000 * size };
  });
const rules = { pixels: 1, slack: 0.5, budget: Infinity, lanes: 1, segment: 1, bytesOf: ({ vertices }) => 100 * vertices };
const levels = levelsOf(0, 1, 2, 4, 8);
const mesh = (scale, arrived = null, goal = null, turn = null) => ({ levels, scale, arrived, goal, turn });
const goals = ({ steps }) => steps.map(({ goal }) => goal);
const reads = ({ steps }) => steps.map(({ read }) => read);
const shows = ({ steps }) => steps.map(({ show }) => show);

test("the coarsest level within an error", () => {
  assert.deepEqual([9, 8, 7.9, 1, 0.5, 0].map((error) => levelWithin(levels, error)), [4, 4, 3, 1, 0, 0]);
});

test("by the root mean square, where that is asked for", () => {
  // A third of the largest: 8/3, 4/3, 2/3, 1/3 from the base down.
  assert.deepEqual([3, 2, 1, 0.5, 0].map((error) => levelWithin(levels, error, "rms")), [4, 3, 2, 1, 0]);
  const by = (measure) => goals(decide([mesh(0.5), mesh(1)], { ...rules, measure }));
  assert.deepEqual([by("max"), by("rms")], [[2, 1], [3, 2]]);
  // The goals take 500 bytes: with 400 the tolerance goes up to the next error on the screen, 4/3 for both.
  const tight = decide([mesh(0.5), mesh(1)], { ...rules, slack: 0, measure: "rms", budget: 400 });
  assert.deepEqual([goals(tight), tight.pixels.toFixed(6)], [[4, 3], (4 / 3).toFixed(6)]);
});

test("the goal is the coarsest level within the tolerance on the screen", () => {
  // At half a pixel a unit, an error of 2 is one pixel; at a tenth, 8 is less than one; at 10, only 0 is within.
  assert.deepEqual(goals(decide([mesh(0.5), mesh(0.1), mesh(10)], rules)), [2, 4, 0]);
});

test("a goal is kept while it is good and not much too good", () => {
  // Level 1 has 0.8, 0.6 and 0.4 pixels; level 2 twice as many. Down only where level 2 has at most 0.5.
  const at = (scale, goal) => goals(decide([mesh(scale, 4, goal)], rules))[0];
  assert.deepEqual([at(0.8, 1), at(0.4, 1), at(0.26, 1), at(0.25, 1)], [1, 1, 1, 2]);
  assert.deepEqual([at(0.51, 2), at(0.4, 3), at(0.1, 0)], [1, 2, 3], "finer at once, coarser by the slack");
});

test("bytes go first to meshes that show nothing, then to the worst on the screen", () => {
  // Errors of the levels arrived: 8 * 1, 4 * 3, 2 * 1.
  const seen = [mesh(1, 4), mesh(3, 3), mesh(1, 2)];
  assert.deepEqual(reads(decide(seen, rules)), [null, 2, null]);
  assert.deepEqual(reads(decide(seen, { ...rules, lanes: 2 })), [3, 2, null]);
  const fresh = { levels: null, scale: 0, arrived: null, goal: null, turn: null };
  assert.deepEqual(reads(decide([...seen, fresh, mesh(1)], rules)), [null, null, null, Infinity, null]);
  assert.deepEqual(reads(decide([...seen, fresh, mesh(1)], { ...rules, lanes: 3 })), [null, 2, null, Infinity, Infinity]);
});

test("a turn is finished, and has a certain length", () => {
  // The first mesh is on its way from level 4 to 2 although the second is worse.
  assert.deepEqual(reads(decide([mesh(1, 4, 0, 2), mesh(9, 4, 0)], rules)), [2, null]);
  assert.deepEqual(reads(decide([mesh(1, 3, 0, 2), mesh(9, 4, 0)], rules)), [2, null]);
  assert.deepEqual(reads(decide([mesh(1, 2, 0, 2), mesh(9, 4, 0)], rules)), [null, 3], "it is over");
  assert.deepEqual(reads(decide([mesh(0, 4, 0, 2), mesh(9, 4, 0)], rules)), [null, 0], "it is out of view, and nobody else waits");
  // Levels end 1,000 bytes apart: 2,500 bytes more than level 4 are those of level 1.
  assert.deepEqual(reads(decide([mesh(9, 4), mesh(1, 4)], { ...rules, segment: 2500 })), [1, null]);
  assert.deepEqual(reads(decide([mesh(9, 4)], rules)), [0], "nobody waits");
  assert.deepEqual(reads(decide([mesh(0.5, 4), mesh(0.1, 4)], { ...rules, segment: 9e9 })), [2, null], "no further than the goal");
});

test("where the file has ended as a prefix, nothing is asked for behind it", () => {
  // Level 0 has 10 pixels, and 2 is the finest that there is.
  const ended = { ...mesh(10, 2), last: 2 };
  assert.deepEqual([goals(decide([ended], rules)), reads(decide([ended], rules))], [[2], [null]]);
  assert.deepEqual(reads(decide([ended, mesh(1, 3)], rules)), [null, 1], "it has no turn, and the other one is not made to wait");
  assert.deepEqual(goals(decide([{ ...mesh(0.26, 2), last: 2 }], rules)), [2], "coarser where that is good enough, as ever");
});

test("what is finer than its goal shows its goal", () => {
  assert.deepEqual(shows(decide([mesh(0.1, 0, 0), mesh(10, 0, 0), mesh(10, 3)], rules)), [3, null, null]);
});

test("out of view a mesh stays as it is and gets nothing", () => {
  const { steps } = decide([mesh(0, 3, 1), mesh(0, 1, 3), mesh(0)], rules);
  assert.deepEqual(steps, [
    { goal: 3, show: null, read: null },
    { goal: 3, show: 3, read: null },
    { goal: 4, show: null, read: null },
  ]);
});

test("over the budget, what is out of view goes down first, then all by the same tolerance", () => {
  // Goals 0, 1, and 1 out of view: 500 + 400 + 400 bytes.
  const seen = [mesh(2, 1, 0), mesh(1, 1, 1), mesh(0, 1, 1)];
  const within = (budget) => decide(seen, { ...rules, budget });
  assert.deepEqual([goals(within(1300)), within(1300).bytes], [[0, 1, 1], 1300]);
  assert.deepEqual([goals(within(1299)), within(1299).bytes, within(1299).pixels], [[0, 1, 4], 1000, 1]);
  // Next: errors 2, 4, 8, 16 and 1, 2, 4, 8 pixels of levels 1 to 4. Goals are kept within the slack: at 2 the first goes to 1 only where
  // half of it allows level 1, at 4, but at 2 the second goes to level 1 still, and at 4 to 2.
  const less = within(999);
  assert.deepEqual(goals(less), [1, 2, 4]);
  assert.ok(Math.abs(less.pixels - 4) < 1e-6);
  assert.equal(less.bytes, 400 + 300 + 100);
  assert.deepEqual(goals(within(300)), [4, 4, 4]);
  const none = within(299);
  assert.deepEqual([goals(none), none.pixels, none.bytes], [[4, 4, 4], Infinity, 300], "bases stay");
});

test("the budget is kept, and the tolerance is the smallest that does so", () => {
  let seed = 1;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  for (let round = 0; round < 300; round++) {
    const seen = Array.from({ length: 1 + Math.floor(6 * random()) }, () => {
      const errors = Array.from({ length: 1 + Math.floor(7 * random()) }, () => random()).sort((a, b) => a - b);
      const own = levelsOf(0, ...errors);
      return { levels: own, scale: random() < 0.2 ? 0 : 20 * random(), arrived: null, goal: null, turn: null };
    });
    const budget = 3000 * random();
    const { steps, pixels, bytes } = decide(seen, { ...rules, budget });
    const sum = (at) => seen.reduce((sum, mesh, k) => sum + 100 * mesh.levels[at(mesh, k)].vertices, 0);
    assert.equal(bytes, sum((_, k) => steps[k].goal));
    const bases = sum((mesh) => mesh.levels.length - 1);
    assert.ok(bytes <= Math.max(budget, bases));
    if (pixels > 1 && pixels < Infinity) {
      // A little less of it would take too much.
      const finer = sum(({ levels, scale }) => (scale > 0 ? levelWithin(levels, (pixels * (1 - 1e-6)) / scale) : levels.length - 1));
      assert.ok(finer > budget, `${pixels}`);
    }
  }
});
