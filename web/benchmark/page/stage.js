// What is measured in the page: a loader loads a mesh, three.js draws it, and it is noted what was in the picture when.

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  Sphere,
  Vector3,
  WebGLRenderer,
} from "three";

class Stage {
  #renderer = new WebGLRenderer({ antialias: true });
  #scene = new Scene();
  #camera = new PerspectiveCamera(30, 1, 0.01, 100);
  #material = new MeshStandardMaterial({ color: 0xc9d3df, roughness: 0.65, side: DoubleSide });
  #object = null;
  #loaders = {};
  #copies = [];

  constructor() {
    document.body.append(this.#renderer.domElement);
    this.#scene.background = new Color(0x15181d);
    const light = new DirectionalLight(0xffffff, 2.6);
    light.position.set(0.9, 1.2, 0.9);
    this.#camera.add(light);
    this.#scene.add(this.#camera, new HemisphereLight(0xdde8ff, 0x3a3630, 0.8));
    this.#renderer.setSize(64, 64);
  }

  /** Fetches a loader, if it is not there. */
  async loader(kind) {
    return (this.#loaders[kind] ??= await import(`/${kind}.js`));
  }

  /**
   * Loads a mesh and returns `{ moments, heap, normals }`: for each picture with something new when it was shown, in milliseconds since the
   * call, and what was in it; the most bytes of the script heap at any picture; milliseconds that normals took. `copies`: times at which
   * the mesh is copied, for `draw`.
   */
  async load(kind, url, copies = []) {
    this.clear();
    const begin = performance.now();
    performance.mark("bench-begin");
    const moments = [];
    const told = { heap: 0, normals: 0 };
    let [pending, drawn] = [null, null];
    const frame = () => {
      const now = performance.now();
      // The picture drawn in the frame before is on the screen now.
      if (drawn) moments.push({ time: now - begin, ...drawn });
      drawn = pending;
      pending = null;
      while (this.#copies.length < copies.length && now - begin >= copies[this.#copies.length]) this.#copy(drawn ?? moments.at(-1));
      if (drawn) this.#measured("bench-draw", () => this.#renderer.render(this.#scene, this.#camera));
      told.heap = Math.max(told.heap, performance.memory?.usedJSHeapSize ?? 0);
      const last = drawn ?? moments.at(-1);
      if (!drawn && last?.complete && this.#copies.length === copies.length) finished();
      else if (!failed) requestAnimationFrame(frame);
    };
    let [finished, failed] = [null, false];
    const end = new Promise((resolve) => (finished = resolve));
    requestAnimationFrame(frame);
    const { load } = await this.loader(kind);
    const loading = load(url, {
      material: this.#material,
      show: (object) => this.#show(object),
      changed: (state) => (pending = { ...state, applied: performance.now() - begin }),
      normals: (geometry) => (told.normals += this.#measured("bench-normals", () => geometry.computeVertexNormals())),
    });
    await Promise.all([loading, end]).catch((error) => {
      failed = true;
      throw error;
    });
    performance.mark("bench-end");
    return { moments, ...told, triangles: this.#triangles() };
  }

  /** Draws the mesh as it was at a time of `copies`, as large as is said; `null` where there was none. */
  draw(number, width, height) {
    const copy = this.#copies[number];
    if (!copy?.group.length) return null;
    for (const mesh of this.#scene.children.filter((child) => child.isMesh || child.isGroup)) this.#scene.remove(mesh);
    this.#scene.add(...copy.group);
    this.#renderer.setPixelRatio(1);
    this.#renderer.setSize(width, height);
    this.#fit(width / height, new Box3().setFromObject(copy.group[0]));
    this.#renderer.render(this.#scene, this.#camera);
    const picture = this.#renderer.domElement.toDataURL("image/png");
    for (const mesh of copy.group) {
      this.#scene.remove(mesh);
      mesh.geometry.dispose();
    }
    return { picture, ...copy.state };
  }

  clear() {
    if (this.#object) this.#scene.remove(this.#object);
    this.#object?.traverse((mesh) => mesh.geometry?.dispose());
    this.#object = null;
    this.#copies = [];
  }

  #show(object) {
    this.#object = object;
    this.#scene.add(object);
    this.#fit(1, new Box3().setFromObject(object));
  }

  #fit(aspect, box) {
    const sphere = box.getBoundingSphere(new Sphere());
    const distance = (0.85 * sphere.radius) / Math.sin((this.#camera.fov / 360) * Math.PI) / Math.min(1, aspect);
    this.#camera.aspect = aspect;
    this.#camera.near = distance / 100;
    this.#camera.far = 10 * distance;
    this.#camera.position.copy(sphere.center).addScaledVector(new Vector3(0.2, 0.2, 1).normalize(), distance);
    this.#camera.lookAt(sphere.center);
    this.#camera.updateProjectionMatrix();
  }

  /** Copies what is shown. */
  #copy(state) {
    const group = [];
    this.#object?.updateMatrixWorld(true);
    this.#object?.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const { attributes, index, drawRange } = mesh.geometry;
      const geometry = new BufferGeometry();
      // Interleaved ones become plain.
      for (const name of ["position", "normal"]) geometry.setAttribute(name, attributes[name].clone());
      geometry.setIndex(new BufferAttribute(index.array.slice(0, Math.min(index.count, drawRange.count)), 1));
      geometry.boundingBox = mesh.geometry.boundingBox;
      const copy = new Mesh(geometry, this.#material);
      copy.applyMatrix4(mesh.matrixWorld);
      group.push(copy);
    });
    this.#copies.push({ group, state });
  }

  #triangles() {
    let triangles = 0;
    this.#object.traverse((mesh) => {
      if (mesh.isMesh) triangles += Math.min(mesh.geometry.index.count, mesh.geometry.drawRange.count) / 3;
    });
    return triangles;
  }

  /** Milliseconds that it took; the trace knows them by name. */
  #measured(name, act) {
    const start = performance.now();
    act();
    return performance.measure(name, { start }).duration;
  }
}

/** Draw calls are left out, or not: uploads are not. */
const drawing = WebGL2RenderingContext.prototype.drawElements;
const setDrawing = (on) => (WebGL2RenderingContext.prototype.drawElements = on ? drawing : () => {});

Object.assign(globalThis, { stage: new Stage(), setDrawing });
