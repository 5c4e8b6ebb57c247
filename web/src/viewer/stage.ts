// The picture: camera, light, the mesh and its edges. It is drawn when something has changed.

import {
  Color,
  DirectionalLight,
  DoubleSide,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  type Material,
  MeshStandardMaterial,
  NeutralToneMapping,
  NoToneMapping,
  PerspectiveCamera,
  Scene,
  type Texture,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { environment } from "./environment.js";
import { dress, shownMesh, shownScene, type Shown } from "./shown.js";
import { texture } from "./texture.js";
import type { UnweldGLTF } from "../gltf.js";
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
  #lined = false;
  #sliding = true;
  readonly #slides: { time: { value: number }; seconds: { value: number } }[];
  readonly #lights: [DirectionalLight, HemisphereLight];
  #environment: Texture | null = null;
  #shown: Shown | null = null;
  /** The mesh shown, where it is one. */
  #geometry: UnweldGeometry | null = null;
  #edges: UnweldEdges | null = null;
  #isPlaying = false;
  #before = 0;
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
    this.#lights = [light, new HemisphereLight(0xdde8ff, 0x3a3630, 0.8)];
    this.#scene.add(this.#camera, this.#lights[1]);
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

  /** Shows another mesh; what was there before is disposed of. */
  show(geometry: UnweldGeometry): void {
    this.#exchange(shownMesh(geometry, this.#material));
    this.#geometry = geometry;
    this.edges(this.#lined);
    geometry.addEventListener("refine", () => this.#look());
    this.#look();
    this.fit();
  }

  /** Shows a scene with its materials, in light from all sides; what was there before is disposed of. */
  showScene(gltf: UnweldGLTF): void {
    this.#exchange(shownScene(gltf));
    this.slide(this.#sliding);
    this.#look();
    this.fit();
  }

  #exchange(shown: Shown): void {
    this.#outline(null);
    if (this.#shown) this.#scene.remove(this.#shown.object);
    this.#shown?.dispose();
    this.#shown = shown;
    this.#geometry = null;
    this.#isPlaying = false;
    this.#scene.add(shown.object);
    const own = shown.materials.length > 0;
    if (own) this.#environment ??= environment(this.#renderer);
    this.#scene.environment = own ? this.#environment : null;
    this.#renderer.toneMapping = own ? NeutralToneMapping : NoToneMapping;
    for (const light of this.#lights) light.visible = !own;
  }

  /** The animations of what is shown, by name. */
  get clips(): readonly string[] {
    return this.#shown?.clips ?? [];
  }

  /** Plays an animation, or none with `null`. */
  play(clip: number | null): void {
    this.#shown?.play(clip);
    this.#isPlaying = clip !== null;
    this.#before = performance.now();
    this.draw();
  }

  edges(shown: boolean): void {
    this.#lined = shown;
    this.#outline(shown ? this.#geometry : null);
    this.#look();
  }

  #outline(of: UnweldGeometry | null): void {
    this.#scene.children.filter((child) => child instanceof LineSegments).forEach((lines) => this.#scene.remove(lines));
    this.#edges?.dispose();
    this.#edges = of && new UnweldEdges(of);
    if (this.#edges) this.#scene.add(new LineSegments(this.#edges, this.#lines));
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
    dress(this.#shown?.materials ?? [], this.#lined, this.#flat);
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
    this.#sliding = on;
    for (const { seconds } of this.#sliders) seconds.value = on ? SLIDE : 0;
    this.draw();
  }

  get #sliders(): readonly { time: { value: number }; seconds: { value: number } }[] {
    return [...this.#slides, ...(this.#shown?.slide ? [this.#shown.slide] : [])];
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
      const time = this.#shown?.clock() ?? 0;
      for (const slide of this.#sliders) slide.time.value = time;
      if (this.#isPlaying) this.#shown?.move((begin - this.#before) / 1000);
      this.#before = begin;
      this.#renderer.render(this.#scene, this.#camera);
      this.drawn.count++;
      this.drawn.longest = Math.max(this.drawn.longest, performance.now() - begin);
      if (this.#isPlaying || (this.#sliding && time - (this.#shown?.lastBorn() ?? 0) < SLIDE)) this.draw();
    });
  }

  /** Puts the camera so that all of the mesh is seen. */
  fit(): void {
    const sphere = this.#shown?.sphere();
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
