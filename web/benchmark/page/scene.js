// What is measured of scenes: a loader loads one, three.js draws it with its materials, and each picture is compared with the last.

import { AmbientLight, Box3, Color, DirectionalLight, PerspectiveCamera, Scene, Sphere, Vector3, WebGLRenderer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { UnweldGLTFLoader } from "../../dist/gltf.js";

const SIZE = 192;
const renderer = new WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
renderer.setSize(SIZE, SIZE);
document.body.append(renderer.domElement);

const loaders = {
  unweld: (url, changed) => {
    const loader = new UnweldGLTFLoader();
    return loader.loadAsync(url).then((gltf) => {
      const { unweld } = gltf;
      unweld.addEventListener("refine", () => changed(unweld.last.bytes));
      unweld.addEventListener("texture", () => changed(unweld.last.bytes));
      return { scene: gltf.scene, bytes: unweld.last.bytes, complete: unweld.complete };
    });
  },
  draco: (url) => new GLTFLoader().setDRACOLoader(draco).loadAsync(url),
  meshopt: (url) => new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(url),
};
const draco = new DRACOLoader().setDecoderPath("/draco/").preload();
MeshoptDecoder.useWorkers(2);

/** Loads a scene: for each picture with something new its time, bytes and PSNR against the last, and the longest task that was no drawing. */
globalThis.loadScene = async (kind, url) => {
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
    renderer.render(scene, camera);
    const gl = renderer.getContext();
    const pixels = new Uint8Array(4 * SIZE * SIZE);
    gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
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
