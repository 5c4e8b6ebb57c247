// A copy of a mesh that deltas are applied to, checked at each of them.

import assert from "node:assert/strict";

export class Mirror {
  position = new Float32Array(0);
  normal = new Float32Array(0);
  indices = new Uint32Array(0);
  vertices = 0;
  triangles = 0;
  last = null;
  levels = [];
  /** The attributes that are alive: names, the vertex of each wedge, the wedges of each triangle, and values by name. */
  dress = null;

  apply(delta) {
    const { vertices, triangles, firstVertex, firstTriangle } = delta;
    const all = firstVertex === 0;
    assert.ok(all || firstVertex === this.vertices, "vertices are appended to those there were");
    assert.ok(all || firstTriangle === this.triangles, "triangles are appended to those there were");
    for (const name of ["position", "normal"]) {
      assert.equal(delta.appended[name].length, 3 * (vertices - firstVertex));
      const array = grown(this[name], 3 * vertices);
      array.set(delta.appended[name], 3 * firstVertex);
      const { vertices: places, values } = delta.changed[name];
      places.forEach((v, k) => {
        assert.ok(v < firstVertex, "what changes was there");
        array.set(values.subarray(3 * k, 3 * k + 3), 3 * v);
      });
      this[name] = array;
    }
    assert.equal(delta.from.length, 3 * (vertices - firstVertex));
    assert.equal(delta.indices.length, 3 * (triangles - firstTriangle));
    this.indices = grown(this.indices, 3 * triangles);
    this.indices.set(delta.indices, 3 * firstTriangle);
    delta.rewritten.triangles.forEach((t, k) => {
      assert.ok(t < firstTriangle, "what is rewritten was there");
      this.indices.set(delta.rewritten.indices.subarray(3 * k, 3 * k + 3), 3 * t);
    });
    Object.assign(this, { vertices, triangles, last: delta });
    if (all) this.dress = null;
    if (delta.attributes) this.#wear(delta);
    this.levels.push(...delta.levels);
    assert.ok(this.indices.subarray(0, 3 * triangles).every((v) => v < vertices), "each triangle has its vertices");
  }

  #wear({ attributes, contents, triangles, firstTriangle, rewritten }) {
    const { alive, firstTriangle: first, firstWedge, vertices, indices, values, rewritten: others } = attributes;
    if (first === 0) this.dress = { alive, vertices: [], indices: [], values: Object.fromEntries(alive.map((name) => [name, []])) };
    else assert.equal(first, firstTriangle, "what is told goes on where it was");
    const { dress } = this;
    assert.deepEqual([dress.alive, dress.vertices.length], [alive, firstWedge]);
    dress.vertices.push(...vertices);
    assert.ok(vertices.every((v) => v < this.vertices));
    if (indices.length) dress.indices.splice(3 * first, Infinity, ...indices);
    const places = first === 0 ? [] : rewritten.triangles;
    places.forEach((t, k) => others.indices.length && dress.indices.splice(3 * t, 3, ...others.indices.subarray(3 * k, 3 * k + 3)));
    assert.ok(dress.indices.every((wedge) => wedge < dress.vertices.length));
    for (const { name, domain, components } of contents.fileAttributes.filter(({ name }) => alive.includes(name))) {
      const list = dress.values[name];
      if (domain === "triangle") {
        list.splice(components * first, Infinity, ...values[name]);
        places.forEach((t, k) => list.splice(components * t, components, ...others.values[name].subarray(components * k, components * (k + 1))));
      } else list.push(...values[name]);
      assert.equal(list.length, components * (domain === "corner" ? dress.vertices.length : triangles));
    }
  }

  /** What a corner of a triangle has: its position, then its values in all attributes that are alive. */
  corner(t, k) {
    const { dress, last } = this;
    const v = this.indices[3 * t + k];
    const wedge = dress?.vertices.length ? dress.indices[3 * t + k] : v;
    if (dress?.vertices.length) assert.deepEqual(this.#place(dress.vertices[wedge]), this.#place(v), "a wedge lies where its vertex does");
    const of = last.contents.fileAttributes.filter(({ name }) => dress?.alive.includes(name));
    const numbers = of.map(({ name, domain, components }) => {
      const at = components * (domain === "corner" ? wedge : t);
      return dress.values[name].slice(at, at + components);
    });
    return [...this.#place(v), ...numbers.flat()];
  }

  #place(v) {
    return [...this.position.subarray(3 * v, 3 * v + 3)];
  }

  /** Digest of the triangles with all that their corners have, in any order: what `tests/client.rs` works out of the program's decoder. */
  dressed() {
    let sum = 0;
    for (let t = 0; t < this.triangles; t++) {
      const corners = [0, 1, 2].map((k) => [...new Uint32Array(new Float32Array(this.corner(t, k)).buffer)]);
      const turned = [0, 1, 2].map((k) => [...corners[k], ...corners[(k + 1) % 3], ...corners[(k + 2) % 3]]);
      sum = (sum + digest(turned.reduce((a, b) => (less(b, a) ? b : a)))) >>> 0;
    }
    return hex(sum);
  }

  /** Digest of the triangles as positions, in any order. */
  sum() {
    const bits = new Uint32Array(this.position.buffer, 0, 3 * this.vertices);
    let sum = 0;
    for (let t = 0; t < this.triangles; t++) {
      const corners = [0, 1, 2].map((k) => [...bits.subarray(3 * this.indices[3 * t + k]).subarray(0, 3)]);
      const turned = [0, 1, 2].map((k) => [...corners[k], ...corners[(k + 1) % 3], ...corners[(k + 2) % 3]]);
      sum = (sum + digest(turned.reduce((a, b) => (less(b, a) ? b : a)))) >>> 0;
    }
    return hex(sum);
  }

  /** Digest of the arrays in their order. */
  exact() {
    return hex(digest(this.indices.subarray(0, 3 * this.triangles), digest(new Uint32Array(this.position.buffer, 0, 3 * this.vertices))));
  }

  /** The mean of the normals of each vertex's triangles, weighted by area, worked out from the arrays alone. */
  normalsAnew() {
    const sums = new Float64Array(3 * this.vertices);
    const p = this.position;
    for (let t = 0; t < this.triangles; t++) {
      const [a, b, c] = this.indices.subarray(3 * t, 3 * t + 3);
      const [u, v] = [b, c].map((x) => [0, 1, 2].map((k) => p[3 * x + k] - p[3 * a + k]));
      const cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const x of [a, b, c]) for (let k = 0; k < 3; k++) sums[3 * x + k] += cross[k];
    }
    return sums;
  }
}

function grown(array, length) {
  if (array.length >= length) return array;
  const larger = new array.constructor(Math.max(length, 2 * array.length));
  larger.set(array);
  return larger;
}

function digest(numbers, hash = 0x811c9dc5) {
  for (const number of numbers) hash = Math.imul(hash ^ number, 0x01000193);
  return hash >>> 0;
}

function less(a, b) {
  const k = a.findIndex((x, k) => x !== b[k]);
  return k >= 0 && a[k] < b[k];
}

function hex(number) {
  return number.toString(16).padStart(8, "0");
}
