// node goldens.mjs FOLDER CORPUS: the files of tests/import/compressed and the seeds of tests/fuzz/corpus that are made of
// them, anew. A small scene; the scene as every method of compress.mjs writes it; and beside each NAME.glb that changes
// numbers NAME.plain.glb, as the encoders' own decoders read it.
import { spawnSync } from 'node:child_process';
import { copyFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import draco3d from 'draco3dgltf';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';
import sharp from 'sharp';
import { readGlb, writeGlb } from './glb.mjs';

const [folder, corpus] = process.argv.slice(2), here = import.meta.dirname;
const WIDE = 21, HIGH = 14, COPIES = 5;
await MeshoptEncoder.ready;
await MeshoptDecoder.ready;

class Builder {
  constructor() { this.gltf = { asset: { version: '2.0' }, buffers: [], bufferViews: [], accessors: [] }; this.parts = []; this.size = 0; }
  view(data, more = {}) {
    const bytes = Buffer.from(data.buffer, data.byteOffset, data.byteLength), pad = -this.size & 3;
    this.parts.push(Buffer.alloc(pad), bytes);
    this.gltf.bufferViews.push({ buffer: 0, byteOffset: this.size += pad, byteLength: bytes.length, ...more });
    this.size += bytes.length;
    return this.gltf.bufferViews.length - 1;
  }
  accessor(data, componentType, type, count, more = {}, view = {}) {
    this.gltf.accessors.push({ bufferView: this.view(data, view), componentType, type, count, ...more });
    return this.gltf.accessors.length - 1;
  }
  write(file) {
    this.gltf.buffers = [{ byteLength: this.size }];
    writeGlb(file, this.gltf, Buffer.concat(this.parts));
  }
}

// A bumpy blanket of WIDE x HIGH vertices.
function blanket() {
  const position = [], normal = [], uv = [], index = [];
  for (let y = 0; y < HIGH; ++y)
    for (let x = 0; x < WIDE; ++x) {
      const height = 0.3 * Math.sin(x * 0.9) * Math.cos(y * 1.3);
      const n = [-0.27 * Math.cos(x * 0.9) * Math.cos(y * 1.3), 1, 0.39 * Math.sin(x * 0.9) * Math.sin(y * 1.3)];
      const length = Math.hypot(...n);
      position.push(x, height, y);
      normal.push(...n.map((c) => c / length));
      uv.push(0.05 + 0.9 * x / (WIDE - 1), 0.05 + 0.9 * y / (HIGH - 1));
      if (x + 1 < WIDE && y + 1 < HIGH) {
        const a = y * WIDE + x;
        index.push(a, a + WIDE, a + 1, a + 1, a + WIDE, a + WIDE + 1);
      }
    }
  return { position: new Float32Array(position), normal: new Float32Array(normal), uv: new Float32Array(uv), index: new Uint16Array(index) };
}

function turns() {
  const q = [];
  for (let i = 0; i < COPIES; ++i) {
    const axis = [Math.sin(i + 1), Math.cos(2 * i), 0.3 - i], length = Math.hypot(...axis), half = 0.4 + 0.7 * i;
    q.push(...axis.map((c) => c / length * Math.sin(half)), Math.cos(half));
  }
  return new Float32Array(q);
}

// Instances of the blanket with a texture. `filtered`: through the codec's three filters.
async function scene(file, { filtered = false, decoded = false } = {}) {
  const b = new Builder(), { position, normal, uv, index } = blanket(), count = WIDE * HIGH;
  const pixels = Buffer.from(Array.from({ length: 16 * 16 * 3 }, (_, i) => [i / 3 % 16 * 15 | 0, (i / 48 | 0) * 14, 90 + i / 12 | 0][i % 3]));
  const picture = await sharp(pixels, { raw: { width: 16, height: 16, channels: 3 } }).png().toBuffer();
  const through = (encoded, n, stride, filter) => {
    const packed = MeshoptEncoder.encodeGltfBuffer(encoded, n, stride, 'ATTRIBUTES', 0);
    if (!decoded) {
      const view = b.view(packed), range = b.gltf.bufferViews.pop();
      b.gltf.bufferViews.push({ buffer: 1, byteOffset: 0, byteLength: n * stride, byteStride: stride,
        extensions: { EXT_meshopt_compression: { ...range, count: n, byteStride: stride, mode: 'ATTRIBUTES', filter } } });
      return view;
    }
    const out = new Uint8Array(n * stride);
    MeshoptDecoder.decodeGltfBuffer(out, n, stride, packed, 'ATTRIBUTES', filter);
    return b.view(out, { byteStride: stride });
  };
  const accessor = (view, componentType, type, n, more = {}) =>
    b.gltf.accessors.push({ bufferView: view, componentType, type, count: n, ...more }) - 1;
  const four = (three) => Float32Array.from({ length: count * 4 }, (_, i) => i % 4 < 3 ? three[(i >> 2) * 3 + i % 4] : 0);
  const attributes = filtered ? {
    POSITION: accessor(through(MeshoptEncoder.encodeFilterExp(position, count, 12, 16), count, 12, 'EXPONENTIAL'), 5126, 'VEC3', count),
    NORMAL: accessor(through(MeshoptEncoder.encodeFilterOct(four(normal), count, 8, 12), count, 8, 'OCTAHEDRAL'), 5122, 'VEC3', count, { normalized: true }),
    COLOR_0: accessor(through(MeshoptEncoder.encodeFilterOct(four(normal), count, 4, 8), count, 4, 'OCTAHEDRAL'), 5121, 'VEC3', count, { normalized: true }),
  } : {
    POSITION: b.accessor(position, 5126, 'VEC3', count, { min: [0, -0.3, 0], max: [WIDE - 1, 0.3, HIGH - 1] }),
    NORMAL: b.accessor(normal, 5126, 'VEC3', count), TEXCOORD_0: b.accessor(uv, 5126, 'VEC2', count),
  };
  const places = { TRANSLATION: b.accessor(new Float32Array(COPIES * 3).map((_, i) => i * 20), 5126, 'VEC3', COPIES),
    ROTATION: filtered
      ? accessor(through(MeshoptEncoder.encodeFilterQuat(turns(), COPIES, 8, 14), COPIES, 8, 'QUATERNION'), 5122, 'VEC4', COPIES, { normalized: true })
      : b.accessor(turns(), 5126, 'VEC4', COPIES) };
  const compressed = [...filtered ? ['KHR_mesh_quantization'] : [], ...filtered && !decoded ? ['EXT_meshopt_compression'] : []];
  Object.assign(b.gltf, { scene: 0, scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, extensions: { EXT_mesh_gpu_instancing: { attributes: places } } }],
    meshes: [{ primitives: [{ attributes, indices: b.accessor(index, 5123, 'SCALAR', index.length), material: 0 }] }],
    materials: [{ pbrMetallicRoughness: filtered ? {} : { baseColorTexture: { index: 0 } } }],
    extensionsUsed: ['EXT_mesh_gpu_instancing', ...compressed], extensionsRequired: ['EXT_mesh_gpu_instancing', ...compressed] });
  if (!filtered) Object.assign(b.gltf, { textures: [{ source: 0 }], images: [{ bufferView: b.view(picture), mimeType: 'image/png' }] });
  b.write(file);
  if (filtered && !decoded) {  // the fallback buffer, which has no data
    b.gltf.buffers.push({ byteLength: 65536, extensions: { EXT_meshopt_compression: { fallback: true } } });
    writeGlb(file, b.gltf, Buffer.concat(b.parts));
  }
}

async function decode(file, output) {
  const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    'draco3d.decoder': await draco3d.createDecoderModule(), 'meshopt.decoder': MeshoptDecoder });
  const document = await io.read(file);
  for (const extension of document.getRoot().listExtensionsUsed())
    if (/compression/.test(extension.extensionName)) extension.dispose();
  await io.write(output, document);
}

const at = (name) => join(folder, `${name}.glb`);
await scene(at('scene'));
await scene(at('filters'), { filtered: true });
await scene(at('filters.plain'), { filtered: true, decoded: true });
for (const method of ['meshopt', 'triangles', 'quantized', 'draco', 'sequential', 'webp', 'avif']) {
  const run = spawnSync('node', [join(here, 'compress.mjs'), method, at('scene'), at(method)], { stdio: 'inherit' });
  if (run.status) process.exit(1);
  if (['triangles', 'quantized', 'draco', 'sequential'].includes(method)) await decode(at(method), at(`${method}.plain`));
}

// Seeds: packed data alone (tests/fuzz/targets/meshopt.cpp, draco.cpp), pictures, whole files.
const range = (binary, { byteOffset = 0, byteLength }) => binary.subarray(byteOffset, byteOffset + byteLength);
for (const name of ['meshopt', 'triangles', 'filters', 'quantized']) {
  const { gltf, binary } = readGlb(at(name));
  for (const { extensions } of gltf.bufferViews) {
    const packed = extensions?.EXT_meshopt_compression;
    if (!packed) continue;
    const { mode, filter = 'NONE', byteStride, count } = packed, head = Buffer.alloc(8);
    head.writeUInt8(['ATTRIBUTES', 'TRIANGLES', 'INDICES'].indexOf(mode), 0);
    head.writeUInt8(['NONE', 'OCTAHEDRAL', 'QUATERNION', 'EXPONENTIAL'].indexOf(filter), 1);
    head.writeUInt16LE(byteStride, 2);
    head.writeUInt32LE(count, 4);
    writeFileSync(join(corpus, `meshopt/${mode}-${filter}-${byteStride}`.toLowerCase()), Buffer.concat([head, range(binary, packed)]));
  }
}
for (const name of ['draco', 'sequential']) {
  const { gltf, binary } = readGlb(at(name));
  const { bufferView } = gltf.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression;
  writeFileSync(join(corpus, 'draco', name), range(binary, gltf.bufferViews[bufferView]));
}
for (const name of ['webp', 'avif']) {
  const { gltf, binary } = readGlb(at(name));
  writeFileSync(join(corpus, `image/picture.${name}`), range(binary, gltf.bufferViews[gltf.images[0].bufferView]));
}
for (const name of ['draco', 'triangles', 'filters']) copyFileSync(at(name), join(corpus, `gltf/${name}.glb`));
