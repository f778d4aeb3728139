#include "coordinator/output/context/context.h"

#include "common/base/format.h"

namespace kiln {

std::string page_name(const std::string& stem, const std::string& extension, uint32_t page, uint32_t pages) {
  return pages == 1 ? text("{}.{}", stem, extension) : text("{}.{}.{}", stem, page, extension);
}

}  // namespace kiln
