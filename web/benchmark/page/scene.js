// What is measured of scenes: a loader loads one, three.js draws it with its materials, and each picture is compared with the last. Or nothing is drawn, and
// there is only when the loader had something to draw.

import {
  AmbientLight,
  Box3,
  BoxGeometry,
  Color,
  DataTexture,
  DirectionalLight,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  Sphere,
  Vector3,
  WebGLRenderer,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { UnweldGLTFLoader } from "../../dist/gltf.js";

const SIZE = 192;
const renderer = new WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
renderer.setSize(SIZE, SIZE);
document.body.append(renderer.domElement);

const loaders = {
  unweld: (url, changed) =>
    unweld.loadAsync(url).then((gltf) => {
      const { unweld } = gltf;
      unweld.addEventListener("refine", () => changed(unweld.last.bytes));
      unweld.addEventListener("texture", () => changed(unweld.last.bytes));
      return { scene: gltf.scene, bytes: unweld.last.bytes, complete: unweld.complete };
    }),
  draco: (url) => new GLTFLoader().setDRACOLoader(draco).loadAsync(url),
  meshopt: (url) => new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(url),
};
const unweld = new UnweldGLTFLoader();
const draco = new DRACOLoader().setDecoderPath("/draco/");
MeshoptDecoder.useWorkers(2);

/** Loads a scene and forgets it: loader and decoder are there then, and have run. */
globalThis.warm = async (kind, url) => {
  const loaded = await loaders[kind](url, () => {});
  await loaded.complete;
};

/** What every loader's first picture takes: shaders and a picture of a box with the textures that materials mostly have. */
globalThis.drawBox = () => {
  const scene = new Scene();
  scene.add(new DirectionalLight(0xffffff, 3), new AmbientLight(0xffffff, 1.5));
  const texture = () => Object.assign(new DataTexture(new Uint8Array(4 * 64 * 64).fill(200), 64, 64), { needsUpdate: true });
  const maps = Object.fromEntries(["map", "normalMap", "roughnessMap", "metalnessMap", "aoMap"].map((name) => [name, texture()]));
  scene.add(new Mesh(new BoxGeometry(), new MeshStandardMaterial(maps)));
  const camera = new PerspectiveCamera(35, 1, 0.01, 100);
  camera.position.set(2, 1.4, 3.2);
  camera.lookAt(0, 0, 0);
  const start = performance.now();
  renderer.render(scene, camera);
  renderer.getContext().readPixels(0, 0, 1, 1, WebGLRenderingContext.RGBA, WebGLRenderingContext.UNSIGNED_BYTE, new Uint8Array(4));
  return performance.now() - start;
};

/** Loads a scene: for each picture with something new its time, bytes and PSNR against the last, and the longest task that was no drawing. */
globalThis.loadScene = async (kind, url, isDrawn = true) => {
  const scene = new Scene();
  scene.background = new Color(0.2, 0.2, 0.2);
  const sun = new DirectionalLight(0xffffff, 3);
  sun.position.set(1, 2, 3);
  scene.add(sun, new AmbientLight(0xffffff, 1.5));
  const camera = new PerspectiveCamera(35, 1, 0.01, 100);
  const pictures = [];
  let [waiting, over] = [null, false];
  const spent = [];
  const begin = performance.now();
  const draw = (bytes) => {
    const start = performance.now();
    const pixels = new Uint8Array(4 * SIZE * SIZE);
    if (isDrawn) {
      renderer.render(scene, camera);
      const gl = renderer.getContext();
      gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    }
    pictures.push({ time: performance.now() - begin, bytes, pixels });
    spent.push([start, performance.now()]);
  };
  const frame = () => {
    if (waiting !== null) draw(waiting);
    waiting = null;
    if (!over) requestAnimationFrame(frame);
  };
  const tasks = [];
  const observer = new PerformanceObserver((list) => tasks.push(...list.getEntries()));
  observer.observe({ type: "longtask" });
  const loaded = await loaders[kind](url, (bytes) => (waiting = bytes));
  scene.add(loaded.scene);
  scene.updateMatrixWorld(true);
  const sphere = new Box3().setFromObject(loaded.scene).getBoundingSphere(new Sphere());
  const distance = sphere.radius / Math.sin((camera.fov / 360) * Math.PI);
  camera.position.copy(sphere.center).addScaledVector(new Vector3(0.5, 0.35, 0.8).normalize(), distance);
  Object.assign(camera, { near: distance / 100, far: 10 * distance });
  camera.updateProjectionMatrix();
  camera.lookAt(sphere.center);
  draw(loaded.bytes ?? null);
  requestAnimationFrame(frame);
  await loaded.complete;
  const whole = performance.now() - begin;
  over = true;
  draw(null);
  await new Promise((resolve) => setTimeout(resolve, 100));
  observer.disconnect();
  const last = pictures.at(-1).pixels;
  const psnr = (pixels) => {
    let sum = 0;
    for (let k = 0; k < pixels.length; k++) sum += (pixels[k] - last[k]) ** 2;
    return sum === 0 ? 99 : 10 * Math.log10(255 ** 2 / (sum / ((3 * pixels.length) / 4)));
  };
  const others = tasks.map(({ startTime, duration }) => {
    const drawn = spent.reduce((sum, [from, to]) => sum + Math.max(0, Math.min(to, startTime + duration) - Math.max(from, startTime)), 0);
    return duration - drawn;
  });
  const told = pictures.map(({ time, bytes, pixels }) => ({ time, bytes, psnr: psnr(pixels) }));
  return { pictures: told, whole, longest: Math.max(0, ...others), memory: renderer.info.memory };
};
