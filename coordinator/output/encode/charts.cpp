// charts.json and charts.bin: the chart table. Layout atlas has none: TEXCOORD_1 of the file is the
// lightmap's.
#include "common/base/files.h"
#include "coordinator/output/chart_table/chart_table.h"
#include "coordinator/output/encode/output.h"

namespace kiln {

Expected<std::vector<std::string>> write_charts(const OutputContext& c) {
  if (!c.atlas.packed) return std::vector<std::string>{};
  KILN_TRY_STATUS(write_file_atomic(c.folder / "charts.json", charts_json(c.scene, c.atlas)));
  KILN_TRY_STATUS(write_file_atomic(c.folder / "charts.bin", charts_binary(c.atlas)));
  return std::vector<std::string>{"charts.json", "charts.bin"};
}

}  // namespace kiln
