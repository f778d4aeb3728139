#include "coordinator/farm/snapshot/snapshot.h"

#include <fcntl.h>

#include "common/base/format.h"
#include "coordinator/farm/queue/blob_files.h"
#include "coordinator/farm/snapshot/option_files.h"

namespace kiln {
namespace fs = std::filesystem;

Expected<Snapshot> take_snapshot(const fs::path& scene, const BakeSettings& settings,
                                 const InputRules& rules) {
  KILN_TRY(const std::vector<InputFile> inputs, list_inputs(scene, settings, rules));
  Snapshot snapshot;
  snapshot.scene = inputs.front().path;
  snapshot.settings = settings;
  for (const FileOption& option : kFileOptions) {
    std::string& value = snapshot.settings.*option.value;
    if (names_file(option, value)) value = path_of_option(option, value);
  }
  for (const InputFile& input : inputs) {
    const OpenFile file(input.source, O_RDONLY);
    if (!file.is_open()) return system_error("open", input.source);
    KILN_TRY(const HashedFile hashed, hash_file(file));
    snapshot.files.push_back({input.path, hashed.digest, hashed.size});
    snapshot.sources.push_back(input.source);
  }
  KILN_TRY_STATUS(check_files("input", snapshot.files));
  return snapshot;
}

Status put_snapshot(const Snapshot& snapshot, BlobStore& blobs, int64_t now_ms) {
  for (size_t i = 0; i < snapshot.files.size(); ++i) {
    const FileRecord& file = snapshot.files[i];
    if (blobs.use(file.digest, now_ms)) {
      KILN_TRY(const BlobState state, blobs.verify(file.digest));
      if (state == BlobState::kIntact) continue;
    }
    KILN_TRY(const FileRecord stored, blobs.put_file(snapshot.sources[i], now_ms));
    if (stored.digest != file.digest)
      return fail(
          ErrorKind::kInvalidInput,
          text("{} was changed while the job was submitted: submit it again", snapshot.sources[i].string()));
  }
  return {};
}

BakeSettings settings_in(BakeSettings settings, const fs::path& folder) {
  for (const FileOption& option : kFileOptions) {
    std::string& value = settings.*option.value;
    if (names_file(option, value) && value == path_of_option(option, value))
      value = (folder / value).string();
  }
  return settings;
}

}  // namespace kiln
