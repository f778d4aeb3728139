#include "coordinator/farm/web/request_head.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_head(std::span<const std::byte> data) {
  const auto head = parse_request_head(text_of(data));
  if (!head) return require(head.error().status == 0 || !head.error().why.empty(), "a refusal says why");
  require(head->path.find("..") == std::string::npos || head->path.find('\0') == std::string::npos,
          "a path has no byte that ends it");
}

}  // namespace kiln::fuzz
