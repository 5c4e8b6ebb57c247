// What a material shows of attributes beside what three.js does: texture coordinates as a checkerboard, colours as they are meant.

import type { Material } from "three";

/** Changes a material; `value` 1 shows the checkerboard, 0 does not. Where there are no texture coordinates, they are 0. */
export function texture(material: Material): { value: number } {
  const checker = { value: 0 };
  const before = material.onBeforeCompile.bind(material);
  material.onBeforeCompile = (shader, renderer) => {
    before(shader, renderer);
    shader.uniforms.unweldChecker = checker;
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec2 unweldUv;")
      .replace("#include <uv_vertex>", "#include <uv_vertex>\nunweldUv = uv;")
      // Sources mean colours as displays do; three.js takes them for amounts of light.
      .replace("#include <color_vertex>", "#include <color_vertex>\n#ifdef USE_COLOR\nvColor.rgb = pow(vColor.rgb, vec3(2.2));\n#endif");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nuniform float unweldChecker;\nvarying vec2 unweldUv;")
      .replace(
        "#include <color_fragment>",
        "#include <color_fragment>\n" +
          `vec2 unweldCell = floor(unweldUv * ${SQUARES});\n` +
          "diffuseColor.rgb *= 1.0 - 0.5 * unweldChecker * mod(unweldCell.x + unweldCell.y, 2.0);",
      );
  };
  return checker;
}

/** Squares a unit of texture coordinates. */
const SQUARES = "16.0";
