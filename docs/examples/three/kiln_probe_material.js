// Kiln's probes on the graphics card: textures of docs/shaders/kiln_probes.glsl, GLSL that asks all volumes at once, and
// three's standard material lit by them.
import * as THREE from 'three';
import { VIEW } from './kiln_material.js';

const PER_ROW = 64;

// RGBA, `texels` of them an item, 64 items a row.
function sheet(count, texels, Type, format, type, internal) {
  const rows = Math.ceil(count / PER_ROW), data = new Type(4 * texels * PER_ROW * rows);
  const texture = new THREE.DataTexture(data, texels * PER_ROW, rows, format, type);
  texture.internalFormat = internal;
  texture.needsUpdate = true;
  return { data, texture };
}

function brickTexture(volumes) {
  const bricks = volumes.flatMap((v) => v.bricks);
  const { data, texture } = sheet(bricks.length, 18, Uint32Array, THREE.RGBAIntegerFormat, THREE.UnsignedIntType, 'RGBA32UI');
  bricks.forEach((b, i) => data.set([...b.corner, b.level, b.parent, b.children, b.coarser, 0, ...b.probes], 72 * i));
  return texture;
}

function probeTexture({ count, planes, coefficients }) {
  const { data, texture } = sheet(count, 10, Float32Array, THREE.RGBAFormat, THREE.FloatType, 'RGBA32F');
  const head = ['position.X', 'position.Y', 'position.Z', 'state'].map((name) => planes[name]);
  for (let i = 0; i < count; ++i) {
    head.forEach((plane, k) => { data[40 * i + k] = plane[i]; });
    coefficients.forEach((rgb, k) => rgb.forEach((plane, c) => { data[40 * i + 4 + 4 * k + c] = plane[i]; }));
  }
  return texture;
}

// As many tiles a row as the file has, or more where the texture would be too high.
function distanceTexture({ count, columns, side, distances }, most) {
  if (!distances) return new THREE.DataTexture(new Float32Array(2), 1, 1, THREE.RGFormat, THREE.FloatType);
  const tile = side + 2, { mean, square } = distances.planes, fits = distances.height <= most;
  const across = fits ? distances.width / tile : Math.floor(most / tile);
  const width = across * tile, height = fits ? distances.height : Math.ceil(count / across) * tile;
  const data = new Float32Array(2 * width * height);
  for (let i = 0; i < count; ++i)
    for (let y = 0; y < tile; ++y) {
      let from = (Math.floor(i / columns) * tile + y) * distances.width + (i % columns) * tile;
      let to = 2 * ((Math.floor(i / across) * tile + y) * width + (i % across) * tile);
      for (let x = 0; x < tile; ++x, ++from, to += 2) {
        data[to] = mean[from];
        data[to + 1] = square[from];
      }
    }
  const texture = new THREE.DataTexture(data, width, height, THREE.RGFormat, THREE.FloatType);
  texture.needsUpdate = true;
  return texture;
}

const float = (x) => (Number.isInteger(x) ? `${x}.0` : `${x}`);
function volumesGlsl(volumes) {
  let first = 0;
  const each = volumes.map((v) => {
    const text = `KilnProbeVolume(vec3(${v.min.map(float)}), ${float(v.spacing)}, uvec3(${v.roots.map((n) => `${n}u`)}), ` +
                 `${v.levels}u, ${first}u, ${v.visibility})`;
    first += v.bricks.length;
    return text;
  });
  return `const KilnProbeVolume kilnVolumes[${each.length}] = KilnProbeVolume[${each.length}](${each.join(',\n  ')});`;
}

// {glsl, uniforms} of a KilnProbes; `shader`: the text of kiln_probes.glsl. The GLSL has
//   vec4 kilnProbesAt(vec3 position, vec3 normal, bool visibility)
// E and 1, or 0 where there are no probes, of all volumes, finer ones first.
export function probeShader(probes, shader, renderer) {
  const value = (texture) => ({ value: texture });
  return {
    uniforms: { kilnBricks: value(brickTexture(probes.volumes)), kilnProbes: value(probeTexture(probes)),
                kilnDistances: value(distanceTexture(probes, renderer.capabilities.maxTextureSize)) },
    glsl: `${shader}
uniform highp usampler2D kilnBricks;
uniform highp sampler2D kilnProbes, kilnDistances;
${volumesGlsl(probes.volumes)}
vec4 kilnProbesAt(vec3 position, vec3 n, bool visibility) {
  vec3 sum = vec3(0.0);
  float left = 1.0;
  for (int i = 0; i < ${probes.volumes.length} && left > 0.0; ++i) {
    KilnProbeVolume v = kilnVolumes[i];
    v.visibility = v.visibility && visibility;
    vec4 light = kiln_probe_light(v, kilnBricks, kilnProbes, kilnDistances, position, n, 0.1);
    sum += light.rgb * (left * light.w);
    left *= 1.0 - light.w;
  }
  return left < 1.0 ? vec4(sum / (1.0 - left), 1.0 - left) : vec4(0.0);
}` };
}

// A copy of a standard material whose light is that of the probes, for scenes without a lightmap. `view`: uniforms of
// curves and exposure.
export function probeLitMaterial(material, shader, view) {
  const copy = material.clone();
  copy.onBeforeCompile = (program) => {
    Object.assign(program.uniforms, shader.uniforms, view);
    program.vertexShader = program.vertexShader
      .replace('#include <common>', '#include <common>\nvarying vec3 vKilnWorld;')
      .replace('#include <project_vertex>',
        '#include <project_vertex>\nvKilnWorld = (inverse(viewMatrix) * mvPosition).xyz;');
    program.fragmentShader = program.fragmentShader
      .replace('#include <common>', `#include <common>\nvarying vec3 vKilnWorld;\n${shader.glsl}\n${VIEW}`)
      .replace('#include <lights_fragment_maps>', /* glsl */`
        vec3 kilnE = kilnProbesAt(vKilnWorld, inverseTransformDirection(normal, viewMatrix), true).rgb;
        #include <lights_fragment_maps>
        irradiance += kilnE;
        // What is mirrored, of light that is known to degree 2: E / pi around the mirrored direction, which turns to the
        // normal as the surface gets rough. Metal, glTF's default, has nothing else.
        vec3 kilnMirrored = normalize(mix(reflect(-geometryViewDir, normal), normal, material.roughness * material.roughness));
        radiance += RECIPROCAL_PI * kilnProbesAt(vKilnWorld, inverseTransformDirection(kilnMirrored, viewMatrix), true).rgb;`)
      .replace('#include <opaque_fragment>', /* glsl */`
        outgoingLight = kilnCurve(kilnView == 1 ? 0.5 * kilnE * RECIPROCAL_PI : outgoingLight);
        #include <opaque_fragment>`);
  };
  copy.customProgramCacheKey = () => 'kiln probes';
  return copy;
}
