// libFuzzer's entry for one target.
#include "tests/fuzz/target.h"

namespace kiln::fuzz {
void KILN_FUZZ_TARGET(std::span<const std::byte>);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  kiln::fuzz::KILN_FUZZ_TARGET(std::as_bytes(std::span(data, size)));
  return 0;
}
