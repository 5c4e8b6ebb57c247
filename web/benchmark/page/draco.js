// glTF with KHR_draco_mesh_compression, decoded in workers.

import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { loadWhole } from "./gltf.js";

const draco = new DRACOLoader().setDecoderPath("/draco/").preload();
const loader = new GLTFLoader().setDRACOLoader(draco);

/** See `Stage.load`. */
export const load = (url, stage) => loadWhole(loader, url, stage);
