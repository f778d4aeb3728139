// Loads KTX2 files of raw or block-compressed texels as three.js textures. three's KTX2Loader (r187) is made for
// Basis Universal and supports neither BC6H nor arrays of raw blocks. This uses its parser and zstd decoder.
import * as THREE from 'three';
import { read } from 'three/addons/libs/ktx-parse.module.js';
import { ZSTDDecoder } from 'three/addons/libs/zstddec.module.js';

// By VkFormat: [three's format, three's type, WebGL extension, name].
const BYTE = THREE.UnsignedByteType, HALF = THREE.HalfFloatType;
const FORMATS = {
  37: [THREE.RGBAFormat, BYTE, null, 'R8G8B8A8_UNORM'],
  97: [THREE.RGBAFormat, HALF, null, 'R16G16B16A16_SFLOAT'],
  109: [THREE.RGBAFormat, THREE.FloatType, null, 'R32G32B32A32_SFLOAT'],
  123: [THREE.RGBFormat, THREE.UnsignedInt5999Type, null, 'E5B9G9R9_UFLOAT_PACK32'],
  131: [THREE.RGB_S3TC_DXT1_Format, BYTE, 'WEBGL_compressed_texture_s3tc', 'BC1_RGB_UNORM_BLOCK'],
  133: [THREE.RGBA_S3TC_DXT1_Format, BYTE, 'WEBGL_compressed_texture_s3tc', 'BC1_RGBA_UNORM_BLOCK'],
  139: [THREE.RED_RGTC1_Format, BYTE, 'EXT_texture_compression_rgtc', 'BC4_UNORM_BLOCK'],
  140: [THREE.SIGNED_RED_RGTC1_Format, BYTE, 'EXT_texture_compression_rgtc', 'BC4_SNORM_BLOCK'],
  141: [THREE.RED_GREEN_RGTC2_Format, BYTE, 'EXT_texture_compression_rgtc', 'BC5_UNORM_BLOCK'],
  142: [THREE.SIGNED_RED_GREEN_RGTC2_Format, BYTE, 'EXT_texture_compression_rgtc', 'BC5_SNORM_BLOCK'],
  143: [THREE.RGB_BPTC_UNSIGNED_Format, HALF, 'EXT_texture_compression_bptc', 'BC6H_UFLOAT_BLOCK'],
  144: [THREE.RGB_BPTC_SIGNED_Format, HALF, 'EXT_texture_compression_bptc', 'BC6H_SFLOAT_BLOCK'],
  145: [THREE.RGBA_BPTC_Format, BYTE, 'EXT_texture_compression_bptc', 'BC7_UNORM_BLOCK'],
  157: [THREE.RGBA_ASTC_4x4_Format, BYTE, 'WEBGL_compressed_texture_astc', 'ASTC_4x4_UNORM_BLOCK'],
  165: [THREE.RGBA_ASTC_6x6_Format, BYTE, 'WEBGL_compressed_texture_astc', 'ASTC_6x6_UNORM_BLOCK'],
  171: [THREE.RGBA_ASTC_8x8_Format, BYTE, 'WEBGL_compressed_texture_astc', 'ASTC_8x8_UNORM_BLOCK'],
  1000066000: [THREE.RGBA_ASTC_4x4_Format, HALF, 'WEBGL_compressed_texture_astc', 'ASTC_4x4_SFLOAT_BLOCK'],
  1000066004: [THREE.RGBA_ASTC_6x6_Format, HALF, 'WEBGL_compressed_texture_astc', 'ASTC_6x6_SFLOAT_BLOCK'],
  1000066007: [THREE.RGBA_ASTC_8x8_Format, HALF, 'WEBGL_compressed_texture_astc', 'ASTC_8x8_SFLOAT_BLOCK'],
};

let zstd;
async function decompress(container) {
  if (container.supercompressionScheme === 0) return container.levels.map((l) => l.levelData);
  if (container.supercompressionScheme !== 2) throw new Error(`supercompression ${container.supercompressionScheme} is not read`);
  if (!zstd) await (zstd = new ZSTDDecoder()).init();
  return container.levels.map((l) => zstd.decode(l.levelData, l.uncompressedByteLength));
}

function typed(bytes, type) {
  const Kind = { [HALF]: Uint16Array, [THREE.FloatType]: Float32Array, [THREE.UnsignedInt5999Type]: Uint32Array }[type];
  return Kind ? new Kind(bytes.slice().buffer) : bytes;
}

// `renderer`: queried for the formats that the graphics card supports.
export async function readKtx2(buffer, renderer) {
  const container = read(new Uint8Array(buffer)), known = FORMATS[container.vkFormat];
  if (!known) throw new Error(`format ${container.vkFormat} is not read`);
  const [format, type, extension, name] = known;
  if (extension && !renderer.extensions.has(extension))
    throw new Error(`this graphics card has no ${extension}, which ${name} needs: choose other maps`);
  const levels = await decompress(container), layers = Math.max(1, container.layerCount);
  const { pixelWidth: width, pixelHeight: height } = container;
  let texture;
  if (extension) {
    const mipmaps = levels.map((data, k) =>
      ({ data, width: Math.max(1, width >> k), height: Math.max(1, height >> k) }));
    texture = layers > 1 ? new THREE.CompressedArrayTexture(mipmaps, width, height, layers, format, type)
                         : new THREE.CompressedTexture(mipmaps, width, height, format, type);
  } else {
    const data = typed(levels[0], type);
    texture = layers > 1 ? new THREE.DataArrayTexture(data, width, height, layers)
                         : new THREE.DataTexture(data, width, height);
    texture.format = format;
    texture.type = type;
  }
  return texture;
}
