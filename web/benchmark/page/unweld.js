// The loader of this package.

import { Mesh } from "three";
import { UnweldLoader } from "../../dist/three.js";

const loader = new UnweldLoader();

/** See `Stage.load`. */
export function load(url, { show, changed, material }) {
  return new Promise((resolve, reject) => {
    const state = ({ triangles, bytes, level, complete }) => {
      changed({ triangles, bytes, maxError: level?.maxError, rmsError: level?.rmsError, complete });
    };
    loader.load(
      url,
      (geometry) => {
        show(new Mesh(geometry, material));
        state(geometry.last);
        geometry.addEventListener("refine", ({ delta }) => state(delta));
        geometry.complete.then(resolve, reject);
      },
      undefined,
      reject,
    );
  });
}
