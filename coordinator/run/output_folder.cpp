#include "coordinator/run/output_folder.h"

#include <vector>

#include "common/base/files.h"

namespace kiln {

Status check_output_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  std::vector<fs::path> missing;  // innermost first
  for (fs::path at = fs::absolute(folder, ignored).lexically_normal();
       !at.empty() && !fs::exists(at, ignored); at = at.parent_path()) {
    if (at.has_filename()) missing.push_back(at);
    if (at == at.parent_path()) break;
  }
  const Status status = prepare_output_folder(folder, 0);
  for (const fs::path& made : missing) fs::remove(made, ignored);  // empty folders only
  return status;
}

}  // namespace kiln
