// Unwraps and packs meshes with xatlas (npm xatlasjs, WebAssembly, one thread):
//   node tests/compare/xatlas.mjs IN OUT
// IN is written and OUT read by build/bin/hard_unwrap, which measures both unwrappers by the same code.
// Bilinear footprints are kept apart (padding 0, bilinear true), charts may be turned.
import {createRequire} from 'node:module';
import {readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {pathToFileURL} from 'node:url';

const [, , input, output] = process.argv;
const folder = join(dirname(createRequire(import.meta.url).resolve('xatlasjs')), 'node');
const {Api} = await import(pathToFileURL(join(folder, 'api.mjs')));
const source = readFileSync(join(folder, 'xatlas.js'), 'utf8');
const make = (await import(pathToFileURL(join(folder, 'xatlas.js'))).catch(
  () => import('data:text/javascript,' + encodeURIComponent(source)))).default;

const file = readFileSync(input);
let at = 0;
const u32 = () => (at += 4, file.readUInt32LE(at - 4));
const f32 = () => (at += 4, file.readFloatLE(at - 4));
const floats = n => (at += 4 * n, new Float32Array(file.buffer.slice(file.byteOffset + at - 4 * n, file.byteOffset + at)));
const words = n => (at += 4 * n, new Uint32Array(file.buffer.slice(file.byteOffset + at - 4 * n, file.byteOffset + at)));

const density = f32();
const meshes = [];
for (let n = u32(); n > 0; --n) {
  const vertices = u32(), triangles = u32();
  meshes.push({positions: floats(3 * vertices), normals: floats(3 * vertices), index: words(3 * triangles)});
}

// The wrapper takes indices of 16 bits: larger meshes go in as parts that have no vertex position in common.
function parts_of(mesh) {
  const key = new Map(), weld = [], parent = [];
  const vertices = mesh.positions.length / 3, triangles = mesh.index.length / 3;
  for (let v = 0; v < vertices; ++v) {
    const k = mesh.positions.subarray(3 * v, 3 * v + 3).join();
    if (!key.has(k)) key.set(k, key.size), parent.push(key.size - 1);
    weld.push(key.get(k));
  }
  const find = i => { while (parent[i] !== i) i = parent[i] = parent[parent[i]]; return i; };
  for (let t = 0; t < triangles; ++t)
    for (let k = 1; k < 3; ++k) parent[find(weld[mesh.index[3 * t + k]])] = find(weld[mesh.index[3 * t]]);
  const groups = new Map();
  for (let t = 0; t < triangles; ++t) {
    const root = vertices <= 65535 ? 0 : find(weld[mesh.index[3 * t]]);
    if (!groups.has(root)) groups.set(root, []);
    groups.get(root).push(t);
  }
  const parts = [];
  let part = null;
  for (const group of groups.values()) {
    const own = new Set(group.flatMap(t => [...mesh.index.subarray(3 * t, 3 * t + 3)]));
    if (!part || part.old.length + own.size > 65535) parts.push(part = {triangles: [], old: [], number: new Map()});
    for (const v of own) part.number.set(v, part.old.length), part.old.push(v);
    for (const t of group) part.triangles.push(t);
  }
  return parts.map(({triangles, old, number}) => {
    if (old.length > 65535) throw Error('a connected part has more than 65535 vertices');
    const pick = from => Float32Array.from(old.flatMap(v => [from[3 * v], from[3 * v + 1], from[3 * v + 2]]));
    return {triangles, positions: pick(mesh.positions), normals: pick(mesh.normals),
            index: Uint16Array.from(triangles.flatMap(t => [0, 1, 2].map(k => number.get(mesh.index[3 * t + k]))))};
  });
}

const xatlas = await make({locateFile: name => join(folder, name), onAtlasProgress: () => {}});
const Wrapped = Api(() => Promise.resolve(xatlas));
const api = new Wrapped();
await Promise.resolve();
api.moduleLoaded(xatlas);
api.createAtlas();
const all = meshes.map(parts_of);
const begin = process.cpuUsage();
const ids = all.map(parts => parts.map(p => {
  const added = api.addMesh(p.index, p.positions, p.normals, null, 0, true, false);
  if (!added) throw Error('xatlas refuses a mesh');
  return added.meshId;
}));
const chart_options = {...api.defaultChartOptions(), ...JSON.parse(process.env.XATLAS_CHART ?? '{}')};
xatlas.generateAtlas(chart_options, {...api.defaultPackOptions(), texelsPerUnit: density, ...JSON.parse(process.env.XATLAS_PACK ?? '{}')});
const spent = process.cpuUsage(begin);
const atlas = xatlas.getAtlas();
process.stderr.write(JSON.stringify({width: atlas.width, height: atlas.height, atlases: atlas.atlasCount,
  texels: atlas.texelsPerUnit, seconds: (spent.user + spent.system) / 1e6}) + '\n');

const out = [];
const head = Buffer.alloc(24);
head.writeUInt32LE(atlas.width, 0);
head.writeUInt32LE(atlas.height, 4);
head.writeUInt32LE(atlas.atlasCount, 8);
head.writeFloatLE(atlas.texelsPerUnit, 12);
head.writeDoubleLE((spent.user + spent.system) / 1e6, 16);
out.push(head);
let charts = 0;
for (let m = 0; m < meshes.length; ++m) {
  const triangles = meshes[m].index.length / 3;
  const uv = new Float32Array(6 * triangles), chart_of = new Uint32Array(triangles).fill(0xffffffff);
  all[m].forEach((part, i) => {
    const data = xatlas.getMeshData(ids[m][i]);
    const index = xatlas.HEAPU32.slice(data.indexOffset / 4, data.indexOffset / 4 + data.newIndexCount);
    const coordinates = xatlas.HEAPF32.slice(data.uvOffset / 4, data.uvOffset / 4 + 2 * data.newVertexCount);
    const parent = Array.from({length: data.newVertexCount}, (_, v) => v);
    const find = v => { while (parent[v] !== v) v = parent[v] = parent[parent[v]]; return v; };
    for (let k = 0; k < index.length; ++k) parent[find(index[k])] = find(index[k - k % 3]);
    const number = new Map();
    for (let k = 0; k < index.length; ++k) {
      const t = part.triangles[Math.floor(k / 3)];
      uv[6 * t + 2 * (k % 3)] = coordinates[2 * index[k]] * atlas.width;  // xatlasjs gives shares
      uv[6 * t + 2 * (k % 3) + 1] = coordinates[2 * index[k] + 1] * atlas.height;
      const root = find(index[k]);
      if (!number.has(root)) number.set(root, charts++);
      chart_of[t] = number.get(root);
    }
  });
  out.push(Buffer.from(uv.buffer), Buffer.from(chart_of.buffer));
}
writeFileSync(output, Buffer.concat(out));
