// Lights a three.js scene with a KILN_lightmap: geometry gets the map's coordinates, materials the GLSL that
// evaluates it. Supports MeshStandardMaterial and MeshPhysicalMaterial; unlit ones are only exposed.
import * as THREE from 'three';
import { basisGlsl } from './kiln_basis.js';
import { planesGlsl } from './kiln_maps.js';

// Curves, and colours of legends; replaces three's lighting of a pixel, and its final colour.
export const VIEW = /* glsl */`
uniform int kilnView, kilnLight;
uniform bool kilnFilmic, kilnSpecularOn, kilnPlain;
uniform float kilnExposure, kilnMostSamples;

// Narkowicz 2015, ACES filmic tone mapping curve (fit).
vec3 kilnCurve(vec3 x) {
  x = max(x, 0.0) * kilnExposure;
  return kilnFilmic ? clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0) : x;
}
vec3 kilnLinear(vec3 srgb) {  // legend colours are given in sRGB
  return mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
}
vec3 kilnHeat(float x) {  // black, blue, green, yellow, red
  x = clamp(x, 0.0, 1.0) * 4.0;
  vec3 c = mix(vec3(0.05), vec3(0.15, 0.3, 0.9), min(x, 1.0));
  c = mix(c, vec3(0.1, 0.7, 0.3), clamp(x - 1.0, 0.0, 1.0));
  c = mix(c, vec3(0.95, 0.9, 0.2), clamp(x - 2.0, 0.0, 1.0));
  return kilnLinear(mix(c, vec3(0.9, 0.15, 0.1), clamp(x - 3.0, 0.0, 1.0)));
}
vec3 kilnClass(float v) {  // the colours of validity.png
  int c = int(v + 0.5);
  return kilnLinear(c == 1 ? vec3(0.745) : c == 2 ? vec3(1.0, 0.549, 0.0) : c == 3 ? vec3(1.0, 0.882, 0.157)
                  : c == 4 ? vec3(0.196, 0.431, 1.0) : c == 5 ? vec3(1.0, 0.0, 1.0) : vec3(0.0));
}
vec3 kilnChartColour(float n) {
  vec3 h = fract(vec3(n) * vec3(0.61803, 0.32471, 0.75487) + 0.3);
  return kilnLinear(0.25 + 0.7 * h);
}`;

function fragmentGlsl(maps, masters, responses, diagnostics, { basis, description }) {
  const known = (planes, name) => (planes.known.has(name) ? name.replace('.', '_') : '0.0');
  const light = [maps, masters].find((planes) => planes.known.has('E.R'));
  const functions = basis ? description.basis.functions : [];
  const shown = maps.known.has(`${functions[0]}.R`) ? maps : masters;  // there are maps of E alone
  return `
${maps.declarations}
${masters === maps ? '' : masters.declarations}
${responses.declarations}
${diagnostics.declarations}
${basisGlsl(basis, functions, shown, masters)}
vec3 kilnFetchE(vec3 place) {  // maps without light: as under a white sky
${light ? `${light.code}\nreturn vec3(E_R, E_G, E_B);` : 'return vec3(KILN_PI);'}
}
vec2 kilnFetchVisibility(vec3 place) {
${responses.code}
return vec2(${known(responses, 'ao')}, ${known(responses, 'sky')});
}
vec3 kilnFetchBent(vec3 place) {
${responses.code}
return vec3(${['X', 'Y', 'Z'].map((axis) => known(responses, `bent.${axis}`)).join(', ')});
}
vec3 kilnFetchDiagnostics(vec3 place) {
${diagnostics.code}
return vec3(${known(diagnostics, 'error')}, samples, validity);
}
vec3 kilnIrradiance(KilnTexel t, vec3 n, vec3 m, vec3 place) {
  return kilnLight == 0 ? max(kilnFetchE(place), 0.0)
       : kilnLight == 1 ? kilnShown(t, n, m) : kilnShownOtherwise(t, n, m);
}`;
}

const VARYING = 'varying vec2 vKilnUv;\nflat varying float vKilnPage;\nflat varying float vKilnColour;\n';

function vertexGlsl(charts) {
  const place = charts
    ? `ivec2 kilnRow = ivec2(2 * (int(kilnChart + kilnFirst + 0.5) % ${charts.across}), int(kilnChart + kilnFirst + 0.5) / ${charts.across});
       vec4 kilnMove = texelFetch(kilnCharts, kilnRow, 0);
       vec4 kilnWhere = texelFetch(kilnCharts, kilnRow + ivec2(1, 0), 0);
       vKilnUv = kiln_chart_coordinates(kilnUv, kilnMove.xy, kilnMove.zw, kilnWhere.y > 0.5);
       vKilnPage = kilnWhere.x;`
    : 'vKilnUv = kilnUv; vKilnPage = kilnPage;';
  return { head: `attribute vec2 kilnUv;\nattribute float kilnColour;\nuniform float kilnPage;\n${VARYING}` +
                 (charts ? 'attribute float kilnChart;\nattribute float kilnFirst;\nuniform highp sampler2D kilnCharts;\n' : ''),
           body: `${place}\nvKilnColour = kilnColour;\n` };
}

// A copy of `material` lit by page `page`. `lightmap`: from loadLightmap. `charts`: the chart table as a texture,
// for primitives whose coordinates are relative to charts.
export function litMaterial(material, lightmap, page, charts = null) {
  const copy = material.clone();
  const maps = planesGlsl(lightmap.maps, 'kiln', page);
  const masters = lightmap.maps === lightmap.masters ? maps : planesGlsl(lightmap.masters, 'kilnMaster', page);
  const responses = planesGlsl(lightmap.responses, 'kilnResponse', page);
  const diagnostics = planesGlsl(lightmap.diagnostics, 'kilnDiagnostic', page);
  const vertex = vertexGlsl(charts);
  const fragment = fragmentGlsl(maps, masters, responses, diagnostics, lightmap);
  copy.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, maps.uniforms, masters.uniforms, responses.uniforms, diagnostics.uniforms, lightmap.uniforms,
                  { kilnPage: { value: page } }, charts ? { kilnCharts: { value: charts.texture } } : {});
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', `#include <common>\n${charts ? lightmap.glsl : ''}\n${vertex.head}`)
      .replace('#include <begin_vertex>', `#include <begin_vertex>\n${vertex.body}`);
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>',
        `#include <common>\n${VARYING}\n${lightmap.glsl}\n${lightmap.bases}\n${VIEW}\n${fragment}`)
      .replace('#include <lights_fragment_maps>', /* glsl */`
        vec3 kilnPlace = vec3(vKilnUv, vKilnPage);
        KilnTexel kilnTexel = kilnFetch(kilnPlace);
        // Only the front side is baked; a double-sided surface uses its light on both sides.
        vec3 kilnNormal = inverseTransformDirection(normal, viewMatrix) * faceDirection;
        vec3 kilnSurface = inverseTransformDirection(nonPerturbedNormal, viewMatrix) * faceDirection;
        vec3 kilnE = kilnIrradiance(kilnTexel, kilnSurface, kilnNormal, kilnPlace);
        #include <lights_fragment_maps>
        irradiance += kilnE;
        if (kilnSpecularOn)
          reflectedLight.indirectSpecular += kilnReflected(kilnTexel, kilnSurface, kilnNormal,
            inverseTransformDirection(geometryViewDir, viewMatrix), material.roughness, material.specularColor);`)
      .replace('#include <opaque_fragment>', /* glsl */`
        if (kilnPlain) outgoingLight = diffuseColor.rgb * kilnE / KILN_PI + totalEmissiveRadiance;
        vec4 kilnToLight = kiln_dominant(kilnL1(kilnTexel, kilnSurface), kilnNormal);
        vec3 kilnStated = kilnFetchDiagnostics(kilnPlace);
        vec3 kilnMasterE = kilnShown(kilnFetchMaster(kilnPlace), kilnSurface, kilnNormal);
        float kilnMean = dot(kilnFetchE(kilnPlace), vec3(0.2126, 0.7152, 0.0722));
        if (kilnView == 0) outgoingLight = kilnCurve(outgoingLight);
        else if (kilnView == 1) outgoingLight = kilnCurve(0.5 * kilnE / KILN_PI);
        else if (kilnView == 2) outgoingLight = kilnLinear((0.5 + 0.5 * kilnToLight.xyz) * (0.25 + 0.75 * kilnToLight.w));
        else if (kilnView == 3) outgoingLight = kilnClass(kilnStated.z);
        else if (kilnView == 4) outgoingLight = kilnHeat(kilnStated.y / kilnMostSamples);
        else if (kilnView == 5) outgoingLight = kilnHeat(10.0 * kilnStated.x / max(kilnMean, 1e-20));
        else if (kilnView == 6) outgoingLight = kilnChartColour(vKilnColour);
        else if (kilnView == 8) outgoingLight = kilnLinear(vec3(clamp(kilnFetchVisibility(kilnPlace).x, 0.0, 1.0)));
        else if (kilnView == 9) outgoingLight = kilnLinear(vec3(clamp(kilnFetchVisibility(kilnPlace).y, 0.0, 1.0)));
        else if (kilnView == 10) outgoingLight = kilnLinear(0.5 + 0.5 * kilnFetchBent(kilnPlace));
        else outgoingLight = kilnHeat(20.0 * length(kilnShown(kilnTexel, kilnSurface, kilnNormal) - kilnMasterE) / max(length(kilnMasterE), 1e-20));
        #include <opaque_fragment>`);
  };
  copy.customProgramCacheKey = () => `kiln ${charts ? charts.across : ''} ${fragment}`;
  return copy;
}

// Unlit materials emit their colour, which is exposed like everything else.
export function exposedMaterial(material, lightmap) {
  const copy = material.clone();
  copy.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, lightmap.uniforms);
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n${VIEW}`)
      .replace('#include <opaque_fragment>', 'outgoingLight = kilnView < 2 ? kilnCurve(outgoingLight) : vec3(0.02);\n#include <opaque_fragment>');
  };
  copy.customProgramCacheKey = () => 'kiln unlit';
  return copy;
}

// Chart number of every vertex: vertices are split at chart borders, so charts are the connected components.
export function chartNumbers(geometry) {
  const count = geometry.attributes.position.count, index = geometry.index;
  const parent = new Uint32Array(count).map((_, i) => i);
  const find = (v) => {
    while (parent[v] !== v) v = parent[v] = parent[parent[v]];
    return v;
  };
  if (index) for (let i = 0; i + 2 < index.count; i += 3) {
    const a = find(index.getX(i));
    parent[find(index.getX(i + 1))] = a;
    parent[find(index.getX(i + 2))] = a;
  }
  const numbers = new Map();
  const out = new Float32Array(count);
  for (let v = 0; v < count; ++v) {
    const root = find(v);
    if (!numbers.has(root)) numbers.set(root, numbers.size);
    out[v] = numbers.get(root);
  }
  return new THREE.BufferAttribute(out, 1);
}
