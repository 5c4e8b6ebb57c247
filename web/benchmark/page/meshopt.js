// glTF with EXT_meshopt_compression, decoded in workers.

import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { loadWhole } from "./gltf.js";

MeshoptDecoder.useWorkers(2);
const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);

/** See `Stage.load`. */
export const load = (url, stage) => loadWhole(loader, url, stage);
