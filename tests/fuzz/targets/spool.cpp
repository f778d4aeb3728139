// u32 length of the payload, u16 offset, then the bytes of a spool file; the row says what the file's head
// says, so that only sums can tell them apart.
#include <filesystem>

#include "common/base/files.h"
#include "coordinator/farm/queue/spool_record.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_spool(std::span<const std::byte> data) {
  ByteReader r(data);
  CommitRow row;
  row.job = 1, row.epoch = 1, row.file = 1;
  row.length = r.get<uint32_t>() % (kMaxPayloadBytes + 2);
  row.offset = r.get<uint16_t>();
  if (!r.ok()) return;
  const auto rest = data.subspan(6);
  if (rest.size() >= kSpoolHead) {
    ByteReader head(rest);
    head.get<uint64_t>();
    head.get<uint64_t>();
    row.unit = head.get<uint64_t>();
    row.shape = head.get<uint64_t>();
    head.get<uint64_t>();
    row.digest = head.get<Digest>();
  }
  const std::filesystem::path file = as_file(rest, ".spool"), folder = file.parent_path();
  const std::filesystem::path place = spool_path(folder, {1, 1, 1});
  std::error_code ignored;
  std::filesystem::create_directories(place.parent_path(), ignored);
  std::filesystem::rename(file, place);
  const auto payload = read_spool_record(folder, row);
  require_sentence(payload);
  if (payload) require(payload->size() == row.length, "a payload has the length of its row");
}

}  // namespace kiln::fuzz
