// node compress.mjs METHOD IN.glb OUT.glb: the scene as other programs compress it.
//   meshopt, triangles   EXT_meshopt_compression of all data as it is; triangles may begin at another corner
//   quantized            glTF Transform's meshopt: positions in 14 bits, filters
//   draco, sequential    KHR_draco_mesh_compression, positions in 14 bits: Edgebreaker, or the order of the file
//   webp, avif           textures
import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { draco, meshopt as quantized, textureCompress } from '@gltf-transform/functions';
import draco3d from 'draco3dgltf';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';
import sharp from 'sharp';
import { meshopt } from './glb.mjs';

const [method, input, output] = process.argv.slice(2);

async function transform(...steps) {
  await MeshoptEncoder.ready;
  const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    'draco3d.encoder': await draco3d.createEncoderModule(), 'draco3d.decoder': await draco3d.createDecoderModule(),
    'meshopt.encoder': MeshoptEncoder, 'meshopt.decoder': MeshoptDecoder });
  const document = await io.read(input);
  await document.transform(...steps);
  await io.write(output, document);
}

const METHODS = {
  meshopt: () => meshopt(input, output, 'INDICES'),
  triangles: () => meshopt(input, output, 'TRIANGLES'),
  quantized: () => transform(quantized({ encoder: MeshoptEncoder })),
  draco: () => transform(draco()),
  sequential: () => transform(draco({ method: 'sequential' })),
  webp: () => transform(textureCompress({ encoder: sharp, targetFormat: 'webp', lossless: true })),
  avif: () => transform(textureCompress({ encoder: sharp, targetFormat: 'avif', quality: 90 })),
};
if (!METHODS[method] || !output) {
  console.error(`usage: node compress.mjs ${Object.keys(METHODS).join('|')} IN.glb OUT.glb`);
  process.exit(2);
}
await METHODS[method]();
