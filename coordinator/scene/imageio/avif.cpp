#include "coordinator/scene/imageio/avif.h"

#include <avif/avif.h>

#include <memory>
#include <string_view>

#include "common/base/format.h"

namespace kiln {
namespace {

tl::unexpected<Error> undecodable(const std::string& name, avifResult result) {
  return fail(ErrorKind::kInvalidInput, text("{}: it does not decode: {}", name, avifResultToString(result)));
}

}  // namespace

bool is_avif(std::span<const std::byte> file) {
  return file.size() >= 12 &&
         std::string_view(reinterpret_cast<const char*>(file.data()) + 4, 8) == "ftypavif";
}

Expected<Texture> decode_avif(std::span<const std::byte> file, const std::string& name,
                              const AllowSize& allow) {
  const std::unique_ptr<avifDecoder, decltype(&avifDecoderDestroy)> decoder(avifDecoderCreate(),
                                                                            &avifDecoderDestroy);
  decoder->maxThreads = 1;  // our own threads decode images in parallel
  decoder->ignoreExif = decoder->ignoreXMP = AVIF_TRUE;
  decoder->requestedSource = AVIF_DECODER_SOURCE_PRIMARY_ITEM;
  avifResult result =
      avifDecoderSetIOMemory(decoder.get(), reinterpret_cast<const uint8_t*>(file.data()), file.size());
  if (result == AVIF_RESULT_OK) result = avifDecoderParse(decoder.get());
  if (result != AVIF_RESULT_OK) return undecodable(name, result);
  Texture texture;
  texture.name = name;
  texture.width = decoder->image->width;
  texture.height = decoder->image->height;
  texture.channels = decoder->alphaPresent ? 4 : 3;
  KILN_TRY_STATUS(allow(texture.width, texture.height, texture.channels));
  result = avifDecoderNextImage(decoder.get());
  if (result != AVIF_RESULT_OK) return undecodable(name, result);
  if (decoder->image->width != texture.width || decoder->image->height != texture.height)
    return undecodable(name, AVIF_RESULT_INVALID_IMAGE_GRID);
  texture.texels.resize(size_t{texture.width} * texture.height * texture.channels);
  avifRGBImage rgb;
  avifRGBImageSetDefaults(&rgb, decoder->image);
  rgb.depth = 8;
  rgb.format = texture.channels == 4 ? AVIF_RGB_FORMAT_RGBA : AVIF_RGB_FORMAT_RGB;
  rgb.pixels = reinterpret_cast<uint8_t*>(texture.texels.data());
  rgb.rowBytes = texture.width * texture.channels;
  result = avifImageYUVToRGB(decoder->image, &rgb);
  if (result != AVIF_RESULT_OK) return undecodable(name, result);
  return texture;
}

}  // namespace kiln
