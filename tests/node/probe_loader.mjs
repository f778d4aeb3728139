// node probe_loader.mjs FOLDER: lights the points of FOLDER/points (x y z floats) with docs/examples/three/kiln_probes.js
// and writes FOLDER/light: 27 floats and what is known of each. Where three.js is installed, tiles of distances that a graphics
// card would find too high are checked in the viewer's texture too.
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
if (existsSync(three)) {
  const { probeShader } = await import('../../docs/examples/three/kiln_probe_material.js');
  const count = 199, columns = 2, side = 16, tile = side + 2, width = columns * tile, height = Math.ceil(count / columns) * tile;
  const plane = (f) => Float32Array.from({ length: width * height }, (_, i) => f(i)), zero = new Float32Array(count);
  const tall = { count, columns, side, volumes: [], coefficients: Array(9).fill([zero, zero, zero]),
                 planes: { 'position.X': zero, 'position.Y': zero, 'position.Z': zero, state: zero },
                 distances: { width, height, planes: { mean: plane((i) => i), square: plane((i) => -i) } } };
  for (const most of [height, height - 1, 20 * tile + 5]) {
    const image = probeShader(tall, '', { capabilities: { maxTextureSize: most } }).uniforms.kilnDistances.value.image;
    const across = Math.floor(image.width / tile);
    if (Math.max(image.width, image.height) > most) throw new Error(`${image.width} x ${image.height} texels, of ${most}`);
    for (let i = 0; i < count; ++i)
      for (let y = 0; y < tile; ++y)
        for (let x = 0; x < tile; ++x) {
          const at = 2 * ((Math.floor(i / across) * tile + y) * image.width + (i % across) * tile + x);
          const file = (Math.floor(i / columns) * tile + y) * width + (i % columns) * tile + x;
          if (image.data[at] !== file || image.data[at + 1] !== -file)
            throw new Error(`probe ${i} is not at its place in a texture of ${image.width} x ${image.height}`);
        }
  }
}
