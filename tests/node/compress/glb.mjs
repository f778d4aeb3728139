// Binary glTF in and out, and EXT_meshopt_compression that changes no byte of the data.
import { readFileSync, writeFileSync } from 'node:fs';
import { MeshoptEncoder } from 'meshoptimizer';

const WIDTH = { 5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4 };
const COMPONENTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };
const EXTENSION = 'EXT_meshopt_compression';

export function readGlb(file) {
  const bytes = readFileSync(file);
  const length = bytes.readUInt32LE(12);
  const gltf = JSON.parse(bytes.subarray(20, 20 + length));
  return { gltf, binary: bytes.length > 20 + length ? bytes.subarray(28 + length) : Buffer.alloc(0) };
}

export function writeGlb(file, gltf, binary) {
  const pad = (bytes, value) => Buffer.concat([bytes, Buffer.alloc(-bytes.length & 3, value)]);
  const json = pad(Buffer.from(JSON.stringify(gltf)), 0x20), data = pad(binary, 0);
  const head = (words) => Buffer.from(new Uint32Array(words).buffer);
  writeFileSync(file, Buffer.concat([head([0x46546c67, 2, 28 + json.length + data.length, json.length, 0x4e4f534a]), json,
    head([data.length, 0x004e4942]), data]));
}

class Packer {
  constructor(start) { this.parts = start ? [start] : []; this.length = start?.length ?? 0; }
  add(bytes) {
    const pad = -this.length & 3;
    if (pad) { this.parts.push(Buffer.alloc(pad)); this.length += pad; }
    this.parts.push(Buffer.from(bytes));
    this.length += bytes.length;
    return this.length - bytes.length;
  }
  take() { return Buffer.concat(this.parts); }
}

// How a buffer view's data is packed, or null: an image, or nothing that the codecs take.
function layoutOf(gltf, index, view, indexMode) {
  const users = (gltf.accessors ?? []).filter((a) => a.bufferView === index && !a.sparse);
  if (!users.length || users.some((a) => a.componentType !== users[0].componentType && !view.byteStride)) return null;
  const isIndices = (gltf.meshes ?? []).some((m) => m.primitives.some((p) => p.indices !== undefined && gltf.accessors[p.indices].bufferView === index));
  const byteStride = view.byteStride ?? WIDTH[users[0].componentType] * COMPONENTS[users[0].type];
  if (view.byteLength % byteStride) return null;
  const count = view.byteLength / byteStride;
  if (isIndices)
    return byteStride === 1 || (indexMode === 'TRIANGLES' && count % 3) ? null : { byteStride, count, mode: indexMode };
  return byteStride % 4 || byteStride > 256 ? null : { byteStride, count, mode: 'ATTRIBUTES' };
}

// indexMode INDICES keeps every byte; TRIANGLES may begin a triangle at another of its corners.
export async function meshopt(input, output, indexMode) {
  await MeshoptEncoder.ready;
  const { gltf, binary } = readGlb(input);
  const packed = new Packer();
  let plain = 0;
  for (const [index, view] of gltf.bufferViews.entries()) {
    const from = view.byteOffset ?? 0, data = binary.subarray(from, from + view.byteLength);
    const layout = layoutOf(gltf, index, view, indexMode);
    if (!layout) { view.byteOffset = packed.add(data); continue; }
    const bytes = MeshoptEncoder.encodeGltfBuffer(new Uint8Array(data), layout.count, layout.byteStride, layout.mode, 0);
    view.extensions = { [EXTENSION]: { buffer: 0, byteOffset: packed.add(bytes), byteLength: bytes.length, ...layout } };
    view.buffer = 1;
    view.byteOffset = plain;
    if (layout.mode === 'ATTRIBUTES') view.byteStride = layout.byteStride;
    plain += view.byteLength + 3 & ~3;
  }
  const data = packed.take();
  gltf.buffers = [{ byteLength: data.length }];
  if (plain) gltf.buffers.push({ byteLength: plain, extensions: { [EXTENSION]: { fallback: true } } });
  for (const list of ['extensionsUsed', 'extensionsRequired']) gltf[list] = [...(gltf[list] ?? []), EXTENSION];
  writeGlb(output, gltf, data);
}
