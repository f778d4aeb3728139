// An independent decoder of DDS files: OpenImageIO's reader.
#pragma once

#include <string>

#include "common/base/bytes.h"

namespace kiln::test {

struct DdsPicture {
  std::string error;  // empty: it was read
  int width = 0, height = 0, levels = 0;
  std::vector<uint8_t> bytes;  // RGBA, 8 bits; of files that hold those
  std::vector<float> floats;   // RGBA
};

// One level; a channel that the file does not have is 0, alpha 1.
DdsPicture oiio_read_dds(const Bytes& file, int level = 0);

}  // namespace kiln::test
