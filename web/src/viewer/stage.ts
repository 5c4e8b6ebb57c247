// The picture: camera, light, the mesh and its edges. It is drawn when something has changed.

import {
  Color,
  DirectionalLight,
  DoubleSide,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { texture } from "./texture.js";
import { geomorph, UnweldEdges, type UnweldGeometry } from "../three.js";

export class Stage {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(40, 1, 0.01, 100);
  readonly #controls: OrbitControls;
  readonly #material = new MeshStandardMaterial({ color: PLAIN, roughness: 0.65, side: DoubleSide });
  readonly #lines = new LineBasicMaterial({ color: 0x10141a, transparent: true, opacity: 0.55 });
  readonly #checker: { value: number };
  #flat = false;
  readonly #slides: { time: { value: number }; seconds: { value: number } }[];
  #geometry: UnweldGeometry | null = null;
  #edges: UnweldEdges | null = null;
  #wanted = false;
  #insets = [0, 0];
  /** Pictures drawn, and the longest a picture took, in milliseconds. */
  readonly drawn = { count: 0, longest: 0 };

  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#scene.background = new Color(0x15181d);
    if (new URLSearchParams(location.search).get("up") === "z") this.#camera.up.set(0, 0, 1);
    const light = new DirectionalLight(0xffffff, 2.6);
    light.position.set(0.9, 1.2, 0.9);
    this.#camera.add(light);
    this.#scene.add(this.#camera, new HemisphereLight(0xdde8ff, 0x3a3630, 0.8));
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.enableDamping = true;
    this.#controls.addEventListener("change", () => this.draw());
    this.#material.polygonOffset = true;
    this.#material.polygonOffsetFactor = this.#material.polygonOffsetUnits = 1;
    this.#slides = [this.#material, this.#lines].map((material: Material) => geomorph(material));
    this.#checker = texture(this.#material);
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
  }

  /** Shows another mesh; the one before is disposed of. */
  show(geometry: UnweldGeometry): void {
    const edges = this.#edges !== null;
    this.edges(false);
    this.#scene.children.filter((child) => child instanceof Mesh).forEach((mesh) => this.#scene.remove(mesh));
    this.#geometry?.dispose();
    this.#geometry = geometry;
    this.#scene.add(new Mesh(geometry, this.#material));
    this.edges(edges);
    geometry.addEventListener("refine", () => this.#look());
    this.#look();
    this.fit();
  }

  edges(shown: boolean): void {
    this.#scene.children.filter((child) => child instanceof LineSegments).forEach((lines) => this.#scene.remove(lines));
    this.#edges?.dispose();
    this.#edges = shown && this.#geometry ? new UnweldEdges(this.#geometry) : null;
    if (this.#edges) this.#scene.add(new LineSegments(this.#edges, this.#lines));
    this.draw();
  }

  flat(flat: boolean): void {
    this.#flat = flat;
    this.#look();
  }

  /** Shows texture coordinates as a checkerboard. */
  checker(on: boolean): void {
    this.#checker.value = on ? 1 : 0;
    this.draw();
  }

  /** As the attributes of the mesh have it: its colours, and flat where each triangle has one normal. */
  #look(): void {
    const material = this.#material;
    const flat = this.#flat || (this.#geometry?.flat ?? false);
    const colors = this.#geometry?.hasAttribute("color") ?? false;
    if (flat !== material.flatShading || colors !== material.vertexColors) {
      Object.assign(material, { flatShading: flat, vertexColors: colors, needsUpdate: true });
      material.color.set(colors ? 0xffffff : PLAIN);
    }
    this.draw();
  }

  slide(on: boolean): void {
    for (const { seconds } of this.#slides) seconds.value = on ? SLIDE : 0;
    this.draw();
  }

  /** What of the canvas is hidden at the left and at the bottom, in pixels: the mesh is put in the middle of the rest. */
  inset(left: number, bottom: number): void {
    this.#insets = [left, bottom];
    this.#resize();
  }

  draw(): void {
    if (this.#wanted) return;
    this.#wanted = true;
    requestAnimationFrame(() => {
      this.#wanted = false;
      const begin = performance.now();
      this.#controls.update();
      const time = this.#geometry?.clock() ?? 0;
      for (const slide of this.#slides) slide.time.value = time;
      this.#renderer.render(this.#scene, this.#camera);
      this.drawn.count++;
      this.drawn.longest = Math.max(this.drawn.longest, performance.now() - begin);
      if (this.#slides[0]!.seconds.value > 0 && time - (this.#geometry?.lastBorn ?? 0) < SLIDE) this.draw();
    });
  }

  /** Puts the camera so that all of the mesh is seen. */
  fit(): void {
    const sphere = this.#geometry?.boundingSphere;
    if (!sphere) return;
    const radius = sphere.radius || 1;
    const [width, height] = this.#free();
    const narrow = Math.min(1, width / height);
    const distance = radius / Math.sin((this.#camera.fov / 360) * Math.PI) / narrow;
    const up = this.#camera.up;
    const side = up.z ? new Vector3(0.5, -0.8, 0.35) : new Vector3(0.5, 0.35, 0.8);
    this.#camera.position.copy(sphere.center).addScaledVector(side.normalize(), distance);
    this.#camera.near = radius / 100;
    this.#camera.far = distance + 20 * radius;
    this.#controls.target.copy(sphere.center);
    this.#controls.maxDistance = 10 * distance;
    this.#resize();
  }

  /** Width and height of what is not hidden. */
  #free(): [number, number] {
    const { clientWidth, clientHeight } = this.#renderer.domElement;
    return [Math.max(1, clientWidth - this.#insets[0]!), Math.max(1, clientHeight - this.#insets[1]!)];
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.#renderer.domElement;
    const [width, height] = this.#free();
    this.#renderer.setSize(clientWidth, clientHeight, false);
    this.#camera.aspect = width / height;
    // The camera sees the free part; the rest of the canvas is added to the left and below.
    this.#camera.setViewOffset(width, height, width - clientWidth, 0, clientWidth, clientHeight);
    this.#camera.updateProjectionMatrix();
    this.draw();
  }
}

/** The colour of a mesh without colours. */
const PLAIN = 0xc9d3df;
/** Seconds that a new vertex takes to its place. */
const SLIDE = 0.35;
