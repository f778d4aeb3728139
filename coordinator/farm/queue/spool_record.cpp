#include "coordinator/farm/queue/spool_record.h"

#include <fcntl.h>

#include <algorithm>
#include <charconv>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr uint32_t kMagic = 0x5250534b;  // "KSPR"
constexpr uint16_t kFormat = 1;

// A whole decimal number without sign or leading zero.
std::optional<uint64_t> decimal(std::string_view digits) {
  uint64_t value = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (code != std::errc() || end != digits.data() + digits.size() || text("{}", value) != digits)
    return std::nullopt;
  return value;
}

}  // namespace

std::array<std::byte, kSpoolHead> write_spool_head(const UnitCommit& commit,
                                                   std::span<const std::byte> payload) {
  ByteWriter w;
  w.put(kMagic);
  w.put(kFormat);
  w.put(static_cast<uint16_t>(kSpoolHead));
  w.put(commit.job);
  w.put(commit.unit);
  w.put(commit.shape);
  w.put(static_cast<uint32_t>(payload.size()));
  w.put(uint32_t{0});
  w.put(commit.digest);
  w.put(xxh3(payload));
  Bytes bytes = w.take();
  const uint64_t check = xxh3(bytes);
  std::array<std::byte, kSpoolHead> head;
  KILN_CHECK(bytes.size() + sizeof check == head.size());
  std::copy(bytes.begin(), bytes.end(), head.begin());
  std::memcpy(head.data() + bytes.size(), &check, sizeof check);
  return head;
}

fs::path spool_folder(const fs::path& folder, JobId job) {
  return folder / text("{}", job);
}

fs::path spool_path(const fs::path& folder, const SpoolFileId& id) {
  return spool_folder(folder, id.job) / text("{}-{}.spool", id.epoch, id.file);
}

std::optional<SpoolFileId> spool_id(const fs::path& path) {
  const std::string name = path.filename().string();
  const size_t dash = name.find('-'), dot = name.find(".spool");
  if (dash == std::string::npos || dot == std::string::npos || dot + 6 != name.size()) return std::nullopt;
  const auto job = decimal(path.parent_path().filename().string());
  const auto epoch = decimal(std::string_view(name).substr(0, dash));
  const auto file = decimal(std::string_view(name).substr(dash + 1, dot - dash - 1));
  if (!job || !epoch || !file || *file > UINT32_MAX) return std::nullopt;
  return SpoolFileId{*job, *epoch, static_cast<uint32_t>(*file)};
}

Expected<Bytes> read_spool_record(const fs::path& folder, const CommitRow& row) {
  const fs::path path = spool_path(folder, {row.job, row.epoch, row.file});
  const OpenFile file(path, O_RDONLY);
  if (!file.is_open()) return system_error("open", path);
  const auto damaged = [&](std::string_view what) {
    return fail(ErrorKind::kIo,
                text("{}: {} of the record at {} (unit {} of job {}) is damaged: the unit has to be "
                     "computed again",
                     path.string(), what, row.offset, row.unit, row.job));
  };
  if (row.length > kMaxPayloadBytes) return damaged("the length");
  std::array<std::byte, kSpoolHead> head;
  Bytes payload(row.length);
  if (!file.read_at(head, row.offset)) return damaged("the head");
  if (!file.read_at(payload, row.offset + kSpoolHead)) return damaged("the payload");
  const UnitCommit commit{row.job, row.unit, row.shape, row.digest, {}, false};
  const auto expected = write_spool_head(commit, payload);
  if (head == expected) return payload;
  // The head has the payload's checksum in its last but one word.
  const bool same_head = std::equal(head.begin(), head.end() - 16, expected.begin());
  return damaged(same_head ? "the payload" : "the head");
}

std::optional<JobId> spool_job(const fs::path& folder) {
  return decimal(folder.filename().string());
}

std::vector<std::string> tidy_spool(const fs::path& folder, JobId job, uint64_t epoch,
                                    const std::map<SpoolFileId, uint64_t>& ends) {
  std::vector<std::string> faults;
  std::error_code code;
  const fs::path own = spool_folder(folder, job);
  bool in_use = false;  // by this opening
  for (const fs::path& path : list_folder(own)) {
    const auto id = spool_id(path);
    in_use = in_use || (id && id->epoch >= epoch);
    if (!id || id->epoch >= epoch) continue;
    const auto end = ends.find(*id);
    code.clear();
    if (end == ends.end()) {
      fs::remove(path, code);
    } else if (const uint64_t size = fs::file_size(path, code); !code && size > end->second) {
      fs::resize_file(path, end->second, code);
    }
    if (code) faults.push_back(text("cannot clean up {}: {}", path.string(), code.message()));
  }
  if (!in_use) fs::remove(own, code);  // if empty
  for (const auto& [id, end] : ends) {
    const fs::path path = spool_path(folder, id);
    const uint64_t size = fs::file_size(path, code);
    if (code || size < end)
      faults.push_back(text("{} has {} bytes and should have {}: the missing units run again", path.string(),
                            code ? 0 : size, end));
  }
  return faults;
}

}  // namespace kiln
