// The textures that a bake published and how to decode their texels to lightmap planes; used by scene.glb,
// the report and the viewer.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kiln {

// plane = (scale * texel + bias) * (times.empty() ? 1 : the plane `times`)
struct TextureChannel {
  std::string plane;  // "L0.R", "L1x.G", "E.B"; empty: the channel is unused
  double scale = 1, bias = 0;
  std::string times;  // "L0.R": the texel is a ratio to that plane
  std::string name;   // of the file's channel; empty: R, G, B, A by index
};

struct PublishedTexture {
  std::string uri;          // file beside scene.glb
  std::string container;    // "ktx2", "dds", "exr", "hdr", "png"
  std::string format;       // Vulkan's name, as in texture_format.h
  std::string unpack;       // before scale and bias: "none"; "rgbe", "rgbm", "rgbd" of 8-bit RGBA
  double unpack_range = 1;  // of rgbm and rgbd
  uint32_t width = 0, height = 0, layers = 1, levels = 1;
  uint32_t page = 0;                     // of layer 0; containers without layers have a file a page
  std::vector<TextureChannel> channels;  // R, G, B, A; at most 4
};

// The textures of one --encode name in one container: together they hold every plane of the basis.
struct PublishedEncoding {
  std::string name;       // "bc6h"
  std::string container;  // "ktx2"
  std::vector<PublishedTexture> textures;
};

using TextureList = std::vector<PublishedEncoding>;

}  // namespace kiln
