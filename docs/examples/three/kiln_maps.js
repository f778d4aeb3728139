// The textures of a KILN_lightmap (docs/gltf.md) as three.js textures, and the GLSL that decodes their texels into
// planes. Maps are textures or texture arrays, like their files.
import * as THREE from 'three';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';
import { readExrPlanes } from './exr_planes.js';
import { readKtx2 } from './ktx2_texture.js';

const LETTERS = 'rgba';

export async function fetchOrThrow(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${await response.text()}`);
  return response;
}

function setUp(texture) {
  texture.colorSpace = THREE.NoColorSpace;  // numbers, not colours
  texture.flipY = false;                    // row 0 is v = 0
  texture.wrapS = texture.wrapT = THREE.ClampToEdgeWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = texture.mipmaps?.length > 1 ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter;
  texture.generateMipmaps = false;
  texture.needsUpdate = true;
  return texture;
}

// Masters: every named channel of all pages, four per texture array.
// `pack`: group channels regardless of their names.
async function loadExr(descriptions, folder, pages, pack) {
  const files = await Promise.all(descriptions.map(async (d) =>
    ({ d, exr: await readExrPlanes(await (await fetchOrThrow(folder + d.uri)).arrayBuffer()) })));
  const names = [...new Set(descriptions.flatMap((d) => d.channels.map((c) => c.plane)))].filter((n) => n !== 'set');
  const groups = [];  // R, G, B of one function share a texture
  for (const name of names) {
    const stem = pack ? '' : name.split('.')[0];
    let group = groups.find((g) => g.stem === stem && g.channels.length < 4);
    if (!group) groups.push(group = { stem, channels: [] });
    group.channels.push({ plane: name });
  }
  const { width, height } = files[0].exr;
  return groups.map(({ channels }) => {
    const data = new Float32Array(4 * width * height * pages);
    channels.forEach(({ plane }, c) => {
      for (const { d, exr } of files) {
        const index = d.channels.findIndex((x) => x.plane === plane);
        if (index < 0) continue;
        const { name = 'RGBA'[index], scale = 1, bias = 0 } = d.channels[index];
        const from = exr.planes[name], begin = 4 * width * height * d.page + c;
        if (!from) throw new Error(`${d.uri} has no channel ${name}`);
        for (let i = 0; i < width * height; ++i) data[begin + 4 * i] = from[i] * scale + bias;
      }
    });
    const texture = new THREE.DataArrayTexture(data, width, height, pages);
    texture.type = THREE.FloatType;
    return { channels, unpack: 'none', byPage: () => ({ texture: setUp(texture), first: 0 }) };
  });
}

async function loadImage(description, folder, renderer) {
  const url = folder + description.uri;
  switch (description.container) {
    case 'ktx2': return readKtx2(await (await fetchOrThrow(url)).arrayBuffer(), renderer);
    case 'hdr': return new HDRLoader().loadAsync(url);
    case 'png': return new THREE.TextureLoader().loadAsync(url);
    default: throw new Error(`${description.uri}: this viewer does not read ${description.container}`);
  }
}

async function loadOthers(descriptions, folder, renderer, pages) {
  const slots = new Map();  // files that differ only in their page
  for (const d of descriptions) {
    const key = JSON.stringify([d.channels, d.unpack, d.unpackRange]);
    if (!slots.has(key)) slots.set(key, { channels: d.channels, unpack: d.unpack ?? 'none', range: d.unpackRange ?? 1, files: [] });
    const texture = setUp(await loadImage(d, folder, renderer));
    if (d.unpack === 'srgb') texture.colorSpace = THREE.SRGBColorSpace;  // hardware decodes before filtering
    slots.get(key).files.push({ first: d.page, layers: d.layers, texture });
  }
  for (const slot of slots.values())
    slot.byPage = (page) => slot.files.find((f) => page >= f.first && page < f.first + Math.max(1, f.layers)) ?? slot.files[0];
  if (pages > 1) for (const slot of slots.values()) slot.perPage = slot.files.length > 1;
  return [...slots.values()];
}

// Texels as bytes, if the page has them: textures of images are decoded by the browser.
const dataOf = (texture) => (texture.isCompressedTexture ? texture.mipmaps.map((m) => m.data)
                                                         : texture.image?.data ? [texture.image.data] : null);
function joined(parts) {
  const out = new parts[0].constructor(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}

// One texture array for all slots of one format: a basis has up to 12 functions, and a shader 16 texture units. Slots
// whose exponents are unpacked before filtering stay, as do pages in files of their own.
function mergeSlots(slots, pages) {
  const groups = new Map();
  for (const slot of slots) {
    const { texture, first } = slot.byPage(0), data = dataOf(texture);
    if (!data || slot.unpack === 'rgbe' || slot.unpack === 'srgb' || slot.perPage || first) continue;
    const { width, height, depth } = texture.image, layers = isArray(texture) ? depth : 1;
    if (layers !== 1 && layers !== pages) continue;
    const key = [texture.format, texture.type, width, height, layers, data.length].join();
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push({ slot, texture, data, width, height, layers });
  }
  for (const group of groups.values()) {
    if (group.length < 2) continue;
    const [{ texture, data, width, height, layers }] = group, { format, type, mipmaps } = texture;
    const all = data.map((_, level) => joined(group.map((g) => g.data[level]))), depth = layers * group.length;
    const levels = () => all.map((bytes, level) => ({ ...mipmaps[level], data: bytes }));
    const array = texture.isCompressedTexture
      ? new THREE.CompressedArrayTexture(levels(), width, height, depth, format, type)
      : Object.assign(new THREE.DataArrayTexture(all[0], width, height, depth), { format, type });
    setUp(array);
    group.forEach(({ slot }, k) => { slot.byPage = () => ({ texture: array, first: -k * layers }); });
  }
  return slots;
}

// Slots of an encoding: {channels, unpack, range, byPage(page) -> {texture, first}}; page n is layer n - `first`.
export async function loadEncoding(encoding, folder, renderer, pages, pack = false) {
  const exr = encoding.textures.filter((t) => t.container === 'exr');
  return mergeSlots(exr.length ? await loadExr(exr, folder, pages, pack)
                               : await loadOthers(encoding.textures, folder, renderer, pages), pages);
}

const isArray = (texture) => texture.isDataArrayTexture || texture.isCompressedArrayTexture;
const number = (x) => (Number.isInteger(x) ? `${x}.0` : `${x}`);

// GLSL for functions NAME_PLANE...: samplers, and `Planes` as a list of float variables that `body` may use.
export function planesGlsl(slots, prefix, page) {
  const declarations = [], code = [], uniforms = {}, known = new Set();
  const products = [];
  slots.forEach((slot, i) => {
    const { texture, first } = slot.byPage(page);
    const shared = Object.keys(uniforms).find((name) => uniforms[name].value === texture);
    const map = shared ?? `${prefix}Map${i}`, texel = `${prefix}Map${i}t`;
    if (!shared) {
      uniforms[map] = { value: texture };
      declarations.push(`uniform highp ${isArray(texture) ? 'sampler2DArray' : 'sampler2D'} ${map};`);
    }
    const place = isArray(texture) ? `vec3(place.xy, place.z - ${number(first)})` : 'place.xy';
    code.push(slot.unpack === 'rgbe' ? `vec4 ${texel} = vec4(kiln_rgbe_bilinear(${map}, ${place}), 1.0);`
                                     : `vec4 ${texel} = texture(${map}, ${place});`);
    if (slot.unpack === 'rgbm' || slot.unpack === 'rgbd')
      code.push(`${texel} = vec4(kiln_${slot.unpack}(${texel}, ${number(slot.range)}), 1.0);`);
    slot.channels.forEach(({ plane, scale = 1, bias = 0, times }, c) => {
      if (!plane) return;
      const variable = plane.replace('.', '_');
      known.add(plane);
      (times ? products : code).push(
        `float ${variable} = (${texel}.${LETTERS[c]} * ${number(scale)} + ${number(bias)})` +
        `${times ? ` * ${times.replace('.', '_')}` : ''};`);
    });
  });
  return { declarations: declarations.join('\n'), code: [...code, ...products].join('\n'), uniforms, known };
}
