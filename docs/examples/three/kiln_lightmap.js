// Loads a scene that kiln bake wrote and lights it with its lightmap:
//   const { scene, lightmap } = await loadLitScene('/bake/', 'scene.glb', renderer);
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { readExrPlanes } from './exr_planes.js';
import { basisOf } from './kiln_basis.js';
import { chartNumbers, exposedMaterial, litMaterial } from './kiln_material.js';
import { fetchOrThrow, loadEncoding } from './kiln_maps.js';

const EXTENSION = 'KILN_lightmap';
const shader = (name) => new URL(`../../shaders/${name}`, import.meta.url);
const fetchText = async (url) => (await fetchOrThrow(url)).text();

export function uniformsOf(description) {
  const value = (v) => ({ value: v });
  return { kilnView: value(0), kilnLight: value(basisOf(description) ? 1 : 0),
           kilnFilmic: value(true), kilnSpecularOn: value(false), kilnPlain: value(false),
           kilnExposure: value(description.exposure ?? 1), kilnMostSamples: value(1) };
}

// Containers this loader reads; DDS files have the same content as KTX2 files.
export const readable = (description) => description.encodings.filter((e) => e.container !== 'dds');
export const encodingName = ({ name, container }) => (name === 'masters' ? name : `${name} ${container}`);

// Ambient occlusion, sky visibility and bent normals are shown from the masters, so they are not loaded twice.
const responsePlanes = (description) => new Set((description.responses ?? []).flatMap((r) => r.planes));
const holds = (texture, planes) => texture.channels.some(({ plane }) => planes.has(plane));
function withoutResponses(encoding, planes) {
  return { ...encoding, textures: encoding.textures.filter((t) => !holds(t, planes)) };
}

// The maps of encoding `name`, with or without its container. Without a name, the first encoding that the graphics
// card and the scene's coordinates support.
async function loadMaps(description, folder, renderer, name) {
  const all = readable(description), asked = all.filter((e) => encodingName(e) === name || e.name === name);
  if (name && asked.length === 0)
    throw new Error(`there are no maps '${name}': there are ${all.map(encodingName).join(', ')}`);
  let error;
  for (const encoding of asked.length ? asked : all) {
    try {
      const light = withoutResponses(encoding, responsePlanes(description));
      const maps = await loadEncoding(light, folder, renderer, description.pages);
      if (description.chartTable && maps.some((slot) => slot.perPage))
        throw new Error('a scene with a chart table needs maps that are texture arrays: choose others');
      return { encoding, maps };
    } catch (e) {
      error ??= e;
    }
  }
  throw error;
}

// The table that reflections of Ambient Dice are scaled by, as kiln_bases.glsl reads it.
async function loadDiceResponse() {
  const response = await fetchOrThrow(shader('kiln_dice_response.exr'));
  const { width, height, planes } = await readExrPlanes(await response.arrayBuffer());
  const data = new Uint16Array(2 * width * height);
  for (let i = 0; i < width * height; ++i)
    ['R', 'G'].forEach((name, c) => { data[2 * i + c] = THREE.DataUtils.toHalfFloat(planes[name][i]); });
  const texture = new THREE.DataTexture(data, width, height, THREE.RGFormat, THREE.HalfFloatType);
  texture.magFilter = texture.minFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

async function loadLightmap(description, folder, renderer, name) {
  const masters = description.encodings.find((e) => e.name === 'masters') ?? description.encodings.at(-1);
  const { pages } = description, planes = responsePlanes(description);
  const shown = new Set(['error', 'samples', 'validity']), basis = basisOf(description);
  const [glsl, bases, diceResponse, master, responses, diagnostics] = await Promise.all([
    fetchText(shader('kiln_lightmap.glsl')), basis && basis !== 'sh_l1' ? fetchText(shader('kiln_bases.glsl')) : '',
    /^ad/.test(basis) ? loadDiceResponse() : null,
    loadEncoding(withoutResponses(masters, planes), folder, renderer, pages),
    loadEncoding({ textures: masters.textures.filter((t) => holds(t, planes)) }, folder, renderer, pages, true),
    loadEncoding({ textures: (description.diagnostics ?? []).filter((t) => holds(t, shown)) }, folder, renderer, pages, true)]);
  for (const slot of diagnostics) {  // classes cannot be averaged
    const { texture } = slot.byPage(0);
    texture.magFilter = texture.minFilter = THREE.NearestFilter;
  }
  const loaded = await loadMaps(description, folder, renderer, name);
  const maps = loaded.encoding === masters ? master : loaded.maps;
  const lightmap = { description, glsl, bases, masters: master, responses, diagnostics, maps, encoding: encodingName(loaded.encoding),
                     basis, uniforms: uniformsOf(description) };
  if (diceResponse) lightmap.uniforms.kilnResponse = { value: diceResponse };
  for (const slot of diagnostics) slot.channels.forEach(({ plane }, c) => {
    if (plane !== 'samples') return;
    const { data } = slot.byPage(0).texture.image;
    for (let i = c; i < data.length; i += 4) lightmap.uniforms.kilnMostSamples.value = Math.max(lightmap.uniforms.kilnMostSamples.value, data[i]);
  });
  return lightmap;
}

// charts.bin (docs/engines.md) as a float texture, two texels per chart: scale and offset; page and turned.
async function loadCharts(url) {
  const view = new DataView(await (await fetchOrThrow(url)).arrayBuffer());
  const count = view.getUint32(28, true), begin = Number(view.getBigUint64(40, true));
  const across = 1024, data = new Float32Array(4 * 2 * across * Math.ceil(Math.max(1, count) / across));
  for (let i = 0; i < count; ++i) {
    for (let k = 0; k < 4; ++k) data[8 * i + k] = view.getFloat32(begin + 24 * i + 4 * k, true);
    for (let k = 0; k < 2; ++k) data[8 * i + 4 + k] = view.getUint32(begin + 24 * i + 16 + 4 * k, true);
  }
  const texture = new THREE.DataTexture(data, 2 * across, data.length / (8 * across), THREE.RGBAFormat, THREE.FloatType);
  texture.needsUpdate = true;
  return { texture, across };
}

// Lightmap rectangle of a node: coordinates x scale + offset.
function movedUv(uv, scale, offset) {
  const out = new Float32Array(2 * uv.count);
  for (let v = 0; v < uv.count; ++v) {
    out[2 * v] = uv.getX(v) * scale[0] + offset[0];
    out[2 * v + 1] = uv.getY(v) * scale[1] + offset[1];
  }
  return new THREE.BufferAttribute(out, 2);
}

// A geometry that shares its data and adds the attributes that the material reads.
function litGeometry(mesh, mark, node, description) {
  const from = mesh.geometry, to = new THREE.BufferGeometry();
  to.setIndex(from.index);
  for (const [name, attribute] of Object.entries(from.attributes)) to.setAttribute(name, attribute);
  const set = description.texCoord;
  const uv = from.attributes[set ? `uv${set}` : 'uv'], { scale, offset } = node;
  to.setAttribute('kilnUv', scale || offset ? movedUv(uv, scale ?? [1, 1], offset ?? [0, 0]) : uv);
  to.setAttribute('kilnColour', chartNumbers(from));
  if (mark.chartAttribute) {
    to.setAttribute('kilnChart', from.attributes[mark.chartAttribute.toLowerCase()]);
    const count = mesh.isInstancedMesh ? mesh.count : 1, first = new Float32Array(count).fill(node.firstChart ?? 0);
    const each = from.attributes._FIRST_CHART ?? from.attributes._first_chart;
    if (each) for (let i = 0; i < count; ++i) first[i] = each.getX(i);
    to.setAttribute('kilnFirst', mesh.isInstancedMesh ? new THREE.InstancedBufferAttribute(first, 1)
      : new THREE.BufferAttribute(new Float32Array(from.attributes.position.count).fill(first[0]), 1));
  }
  to.boundingSphere = from.boundingSphere;
  to.boundingBox = from.boundingBox;
  return to;
}

function nodeNumberOf(object, parser) {
  for (let o = object; o; o = o.parent) {
    const found = parser.associations.get(o);
    if (found?.nodes !== undefined) return found.nodes;
  }
}

const nodeOf = (object, parser) => parser.json.nodes[nodeNumberOf(object, parser)] ?? {};

// A lamp whose light is in the map must not shine again. Files without `lamps` do not tell them apart.
const isInMap = (light, { lamps }, parser) =>
  !lamps || (lamps.nodes ?? []).includes(nodeNumberOf(light, parser));

// Returns {gltf, scene, lightmap, probes}: the scene, lit; `probes` is KILN_probes at its root, or null. Of a bake of
// probes alone `lightmap` is null, and nothing is lit yet.
export async function loadLitScene(folder, file, renderer, encoding) {
  const gltf = await new GLTFLoader().loadAsync(folder + file);
  const { parser } = gltf, description = parser.json.extensions?.[EXTENSION]?.lightmaps?.[0];
  const probes = parser.json.extensions?.KILN_probes ?? null;
  if (!description && probes) return { gltf, scene: gltf.scene, lightmap: null, probes };
  if (!description) throw new Error(`${file} has no ${EXTENSION}: bake it with --gltf-lightmap kiln`);
  const lightmap = await loadLightmap(description, folder, renderer, encoding);
  const charts = description.chartTable ? await loadCharts(folder + description.chartTable.uri) : null;
  const materials = new Map();
  const lit = [], remove = [];
  gltf.scene.traverse((object) => {
    if (object.isLight && isInMap(object, description, parser)) remove.push(object);
    if (object.isMesh) lit.push(object);
  });
  for (const light of remove) light.removeFromParent();
  for (const mesh of lit) {
    const { meshes, primitives } = parser.associations.get(mesh) ?? {};
    const mark = parser.json.meshes[meshes]?.primitives[primitives ?? 0].extensions?.[EXTENSION];
    const make = (key, maker) => {
      if (!materials.has(key)) materials.set(key, maker());
      return materials.get(key);
    };
    if (mesh.material.isMeshBasicMaterial) {
      mesh.material = make(`${mesh.material.uuid} unlit`, () => exposedMaterial(mesh.material, lightmap));
    } else if (mark) {
      const node = nodeOf(mesh, parser).extensions?.[EXTENSION] ?? {}, table = mark.chartAttribute ? charts : null;
      const original = mesh.material, page = mark.page ?? 0;
      mesh.geometry = litGeometry(mesh, mark, node, description);
      mesh.material = make(`${original.uuid} ${page} ${!!table}`, () => litMaterial(original, lightmap, page, table));
    }
  }
  return { gltf, scene: gltf.scene, lightmap, probes };
}
