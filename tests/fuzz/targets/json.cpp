#include "common/base/json.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_json(std::span<const std::byte> data) {
  require_sentence(parse_json(text_of(data)));
  require_sentence(parse_flat_json(text_of(data)));
}

}  // namespace kiln::fuzz
