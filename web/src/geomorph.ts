// Materials whose vertices slide to their places.

import type { Material } from "three";

/** Uniforms of materials that `geomorph` has changed. */
export interface Slide {
  readonly time: { value: number };
  readonly seconds: { value: number };
}

/**
 * Lets new vertices slide from the edge that they split to their own places (Hoppe, Progressive Meshes, 1996), for a geometry loaded with
 * `morph`. Set `time.value` to `geometry.clock()` before each picture; `seconds.value` is how long it takes, 0 for not at all.
 */
export function geomorph(material: Material, slide: Slide = { time: { value: 0 }, seconds: { value: 0 } }): Slide {
  const before = material.onBeforeCompile.bind(material);
  material.onBeforeCompile = (shader, renderer) => {
    before(shader, renderer);
    shader.uniforms.unweldTime = slide.time;
    shader.uniforms.unweldSeconds = slide.seconds;
    shader.vertexShader = shader.vertexShader
      .replace(
        "#include <common>",
        "#include <common>\nuniform float unweldTime, unweldSeconds;\nattribute vec3 from;\nattribute float born;",
      )
      .replace(
        "#include <begin_vertex>",
        "float way = unweldSeconds > 0.0 ? smoothstep(0.0, 1.0, (unweldTime - born) / unweldSeconds) : 1.0;\n" +
          "vec3 transformed = mix(from, position, way);",
      );
  };
  return slide;
}
