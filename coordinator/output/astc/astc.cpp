#include "coordinator/output/astc/astc.h"

#define ASTCENC_DYNAMIC_LIBRARY  // its functions have the names of C
#include <astcenc.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

constexpr float kLargestHalf = 65504;

bool is_hdr(TextureFormat format) {
  return format >= TextureFormat::kAstc4x4Sfloat;
}

float preset(BlockEffort effort) {
  return effort == BlockEffort::kFast     ? ASTCENC_PRE_FAST
         : effort == BlockEffort::kNormal ? ASTCENC_PRE_MEDIUM
                                          : ASTCENC_PRE_THOROUGH;
}

struct FreeContext {
  void operator()(astcenc_context* context) const { astcenc_context_free(context); }
};
using Context = std::unique_ptr<astcenc_context, FreeContext>;

Expected<Context> make_context(TextureFormat format, float quality, unsigned flags, unsigned threads) {
  const TextureFormatInfo& info = texture_format(format);
  KILN_CHECK(format >= TextureFormat::kAstc4x4Unorm);
  astcenc_config config{};
  astcenc_error error = astcenc_config_init(is_hdr(format) ? ASTCENC_PRF_HDR_RGB_LDR_A : ASTCENC_PRF_LDR,
                                            info.block_x, info.block_y, 1, quality, flags, &config);
  astcenc_context* context = nullptr;
  if (error == ASTCENC_SUCCESS) error = astcenc_context_alloc(&config, threads, &context);
  if (error == ASTCENC_ERR_OUT_OF_MEM) return fail(ErrorKind::kNoSpace, "not enough memory for ASTC");
  if (error != ASTCENC_SUCCESS)
    return fail(ErrorKind::kInternal, text("libastcenc: {}", astcenc_get_error_string(error)));
  return Context(context);
}

// Calls work(thread) once per thread; the library distributes the blocks. Returns the first thread's error,
// if any.
template <class Work>
Status on_threads(unsigned threads, const Work& work) {
  std::vector<astcenc_error> errors(threads, ASTCENC_SUCCESS);
  parallel_for(
      threads, [&](size_t thread) { errors[thread] = work(static_cast<unsigned>(thread)); }, threads);
  for (const astcenc_error error : errors)
    if (error != ASTCENC_SUCCESS)
      return fail(error == ASTCENC_ERR_OUT_OF_MEM ? ErrorKind::kNoSpace : ErrorKind::kInternal,
                  text("libastcenc: {}", astcenc_get_error_string(error)));
  return {};
}

// Clamps texels and fills those without weight as fill_block does, in blocks of this format.
std::vector<float> prepared(const TextureFormatInfo& info, const BlockImage& image, bool hdr, bool fill) {
  std::vector<float> texels(image.rgba.begin(), image.rgba.end());
  for (size_t i = 0; i < texels.size(); ++i) {
    const float most = hdr && i % 4 < 3 ? kLargestHalf : 1.0f;
    texels[i] = std::isfinite(texels[i]) ? std::clamp(texels[i], 0.0f, most) : 0.0f;
  }
  if (!fill || image.weight.empty()) return texels;
  for (uint32_t top = 0; top < image.height; top += info.block_y)
    for (uint32_t left = 0; left < image.width; left += info.block_x) {
      const uint32_t bottom = std::min(image.height, top + info.block_y);
      const uint32_t right = std::min(image.width, left + info.block_x);
      double sum[4] = {}, weight = 0;
      const auto each = [&](const auto& visit) {
        for (uint32_t y = top; y < bottom; ++y)
          for (uint32_t x = left; x < right; ++x) visit(size_t{y} * image.width + x);
      };
      each([&](size_t texel) {
        if (!(image.weight[texel] > 0)) return;
        weight += image.weight[texel];
        for (size_t c = 0; c < 4; ++c) sum[c] += double{image.weight[texel]} * texels[4 * texel + c];
      });
      each([&](size_t texel) {
        if (image.weight[texel] > 0) return;
        for (size_t c = 0; c < 4; ++c)
          texels[4 * texel + c] = weight > 0 ? static_cast<float>(sum[c] / weight) : 0.0f;
      });
    }
  return texels;
}

unsigned threads_for(uint64_t blocks, unsigned threads) {
  return static_cast<unsigned>(
      std::clamp<uint64_t>(threads ? threads : hardware_threads(), 1, std::max<uint64_t>(1, blocks)));
}

}  // namespace

Expected<Bytes> encode_astc(TextureFormat format, const BlockImage& image, const BlockChoice& choice,
                            bool fill, unsigned threads) {
  const TextureFormatInfo& info = texture_format(format);
  Bytes out(image_bytes(format, image.width, image.height), std::byte{0});
  if (out.empty()) return out;
  for (size_t i = 0; i < image.rgba.size(); ++i)
    if (!std::isfinite(image.rgba[i]) && (image.weight.empty() || image.weight[i / 4] > 0))
      return fail(ErrorKind::kInvalidInput, text("texel {}, {} is not finite and cannot be compressed",
                                                 i / 4 % image.width, i / 4 / image.width));
  std::vector<float> texels = prepared(info, image, is_hdr(format), fill);
  threads = threads_for(out.size() / info.bytes, threads);
  KILN_TRY(const Context context, make_context(format, preset(choice.effort), 0, threads));
  void* slice = texels.data();
  astcenc_image input{image.width, image.height, 1, ASTCENC_TYPE_F32, &slice};
  const astcenc_swizzle swizzle{ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B,
                                choice.alpha ? ASTCENC_SWZ_A : ASTCENC_SWZ_1};
  KILN_TRY_STATUS(on_threads(threads, [&](unsigned thread) {
    return astcenc_compress_image(context.get(), &input, &swizzle, reinterpret_cast<uint8_t*>(out.data()),
                                  out.size(), thread);
  }));
  return out;
}

Expected<std::vector<float>> decode_astc(TextureFormat format, std::span<const std::byte> blocks,
                                         uint32_t width, uint32_t height, unsigned threads) {
  const uint64_t bytes = image_bytes(format, width, height);
  if (blocks.size() < bytes)
    return fail(ErrorKind::kInvalidInput,
                text("{} bytes are too few for {}x{} texels of {}: it takes {}", blocks.size(), width, height,
                     texture_format(format).name, bytes));
  std::vector<float> texels(4 * size_t{width} * height);
  if (texels.empty()) return texels;
  threads = threads_for(bytes / texture_format(format).bytes, threads);
  KILN_TRY(const Context context,
           make_context(format, ASTCENC_PRE_FAST, ASTCENC_FLG_DECOMPRESS_ONLY, threads));
  void* slice = texels.data();
  astcenc_image output{width, height, 1, ASTCENC_TYPE_F32, &slice};
  const astcenc_swizzle swizzle{ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B, ASTCENC_SWZ_A};
  KILN_TRY_STATUS(on_threads(threads, [&](unsigned thread) {
    return astcenc_decompress_image(context.get(), reinterpret_cast<const uint8_t*>(blocks.data()), bytes,
                                    &output, &swizzle, thread);
  }));
  return texels;
}

}  // namespace kiln
