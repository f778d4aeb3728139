// charts.json of an earlier bake.
#include "coordinator/output/chart_table/chart_table.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_layout(std::span<const std::byte> data) {
  require_sentence(read_layout(as_file(data, ".json")));
}

}  // namespace kiln::fuzz
