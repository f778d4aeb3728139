// node probe_loader.mjs FOLDER: lights the points of FOLDER/points (x y z floats) with docs/examples/three/kiln_probes.js
// and writes FOLDER/light: 27 floats and what is known of each.
import { readFileSync, writeFileSync } from 'node:fs';
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
