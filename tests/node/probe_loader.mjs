// node probe_loader.mjs FOLDER: lights the points of FOLDER/points (x y z floats) with docs/examples/three/kiln_probes.js
// and writes FOLDER/light: 27 floats and what is known of each. Where three.js is installed, tiles of distances are checked in
// the viewer's textures too, of any height that a graphics card may allow.
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { KilnProbes } from '../../docs/examples/three/kiln_probes.js';

const folder = process.argv[2] + '/';
const probes = await KilnProbes.load(folder, async (url) => new Response(readFileSync(url)));
const bytes = readFileSync(folder + 'points');
const points = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4), out = [];
for (let i = 0; i < points.length; i += 3) {
  const { coefficients, known } = probes.light({ x: points[i], y: points[i + 1], z: points[i + 2] });
  out.push(...coefficients, known);
}
writeFileSync(folder + 'light', Buffer.from(new Float32Array(out).buffer));

const three = new URL('../../docs/examples/three/node_modules/three', import.meta.url);
if (probes.distances && existsSync(three)) {
  const { probeShader } = await import('../../docs/examples/three/kiln_probe_material.js');
  const tile = probes.side + 2, from = probes.distances;
  for (const most of [16384, from.height, from.height - 1, Math.max(tile * Math.ceil(Math.sqrt(probes.count)), from.height / 2)]) {
    const { data, width, height } = probeShader(probes, '', { capabilities: { maxTextureSize: most } }).uniforms.kilnDistances.value.image;
    const across = Math.floor(width / tile);
    if (Math.max(width, height) > Math.max(most, from.width)) throw new Error(`${width} x ${height} texels, of ${most}`);
    for (let i = 0; i < probes.count; ++i)
      for (const [x, y] of [[0, 0], [5, 11], [tile - 1, tile - 1]]) {
        const at = (Math.floor(i / across) * tile + y) * width + (i % across) * tile + x;
        const file = (Math.floor(i / probes.columns) * tile + y) * from.width + (i % probes.columns) * tile + x;
        if (data[2 * at] !== from.planes.mean[file] || data[2 * at + 1] !== from.planes.square[file])
          throw new Error(`probe ${i} is not at its place in a texture of ${width} x ${height}`);
      }
  }
}
