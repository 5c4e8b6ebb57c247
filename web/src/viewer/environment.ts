// Light all around for materials that reflect: a bright room, made here.

import { BackSide, BoxGeometry, Color, Mesh, MeshBasicMaterial, PMREMGenerator, Scene, type Texture, type WebGLRenderer } from "three";

/** Light from all sides, most of it from lamps at the ceiling and from a window. */
export function environment(renderer: WebGLRenderer): Texture {
  const scene = new Scene();
  const box = new BoxGeometry();
  const add = (light: number, [x, y, z]: number[], [width, height, depth]: number[], side = BackSide as number) => {
    const material = new MeshBasicMaterial({ color: new Color(light, light, light) });
    const mesh = new Mesh(box, material);
    if (side === BackSide) material.side = BackSide;
    mesh.position.set(x!, y!, z!);
    mesh.scale.set(width!, height!, depth!);
    scene.add(mesh);
  };
  const front = 0;
  add(0.35, [0, 2, 0], [12, 8, 12]);
  add(0.12, [0, -1.9, 0], [11.9, 0.1, 11.9], front);
  for (const [x, z] of [[-2.5, -2.5], [2.5, -1], [0, 3]]) add(14, [x!, 5.6, z!], [2, 0.1, 1], front);
  add(5, [5.8, 2.2, 0.5], [0.1, 3, 4], front);
  add(2, [-5.8, 2, -2], [0.1, 2, 2], front);
  const generator = new PMREMGenerator(renderer);
  const { texture } = generator.fromScene(scene, 0.04);
  generator.dispose();
  box.dispose();
  for (const child of scene.children) ((child as Mesh).material as MeshBasicMaterial).dispose();
  return texture;
}
