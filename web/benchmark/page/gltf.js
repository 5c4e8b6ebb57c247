// A glTF file, shown when all of it is there.

import { Group } from "three";

export async function loadWhole(loader, url, { show, changed, material, normals }) {
  const { scene } = await loader.loadAsync(url);
  const group = new Group().add(scene);
  let triangles = 0;
  group.traverse((mesh) => {
    if (!mesh.isMesh) return;
    mesh.material = material;
    if (!mesh.geometry.attributes.normal) normals(mesh.geometry);
    triangles += mesh.geometry.index.count / 3;
  });
  show(group);
  changed({ triangles, complete: true });
}
