#include "coordinator/farm/queue/observed_time.h"

#include <algorithm>
#include <charconv>
#include <ctime>

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/log.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kMinuteMs = 60'000;
constexpr size_t kMaxFile = 4096;
constexpr const char* kAcceptance = "accept-clock";

fs::path clock_file(const fs::path& data) {
  return data / "clock";
}

}  // namespace

ObservedTime::ObservedTime(const ClockRecord& record, int64_t newest_ms, int64_t wall_ms, int64_t steady_ms)
    : record_(record), wall_ms_(wall_ms), steady_ms_(steady_ms) {
  // Records of the future are of a clock that was wrong: they are no measure.
  if (!record_.seen_ms) record_.seen_ms = newest_ms > 0 && newest_ms < wall_ms ? newest_ms : wall_ms;
  observe(wall_ms, steady_ms);
}

void ObservedTime::observe(int64_t wall_ms, int64_t steady_ms) {
  const int64_t elapsed = std::max<int64_t>(0, steady_ms - steady_ms_);
  wall_ms_ = wall_ms;
  steady_ms_ = steady_ms;
  KILN_CHECK(elapsed >= 0 && record_.seen_ms >= 0);
  const int64_t expected = record_.seen_ms + elapsed;
  if (wall_ms <= expected + kLeapMs) {
    record_ = {std::max(wall_ms, expected)};
    return;
  }
  // Since the end of the last coordinator some time may have gone; while one runs, none may be skipped.
  const int64_t claimed = record_.claimed_ms + elapsed, slack = elapsed ? kMinuteMs : kLeapMs;
  const bool evenly = record_.claimed_ms && wall_ms >= claimed - kMinuteMs && wall_ms <= claimed + slack;
  record_ = {expected, wall_ms, evenly ? record_.claimed_for_ms + elapsed : 0};
  if (record_.claimed_for_ms >= kConfirmMs) accept();
}

void ObservedTime::accept() {
  const int64_t before = record_.seen_ms;
  record_ = {std::max(wall_ms_, before)};
  KILN_CHECK(record_.seen_ms >= before);  // time only moves forward
}

ClockRecord read_clock(const fs::path& data) {
  std::error_code code;
  if (!fs::exists(clock_file(data), code)) return {};
  ClockRecord record;
  const auto bytes = read_file(clock_file(data), kMaxFile);
  const auto json =
      parse_json(bytes ? std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size())
                       : std::string_view());
  bool whole = json && json->kind == JsonValue::Kind::kObject;
  for (const auto& [name, value] : {std::pair{"seen_ms", &record.seen_ms},
                                    {"claimed_ms", &record.claimed_ms},
                                    {"claimed_for_ms", &record.claimed_for_ms}}) {
    const JsonValue* member = whole ? json->find(name) : nullptr;
    whole = member && member->is_whole && !member->negative && member->whole < uint64_t{1} << 60;
    if (whole) *value = static_cast<int64_t>(member->whole);
  }
  if (whole) return record;
  log_warning(text("{} is damaged: the time of the newest record is taken for the last that was seen",
                   clock_file(data).string()));
  return {};
}

Status write_clock(const fs::path& data, const ClockRecord& record) {
  return write_file_atomic(clock_file(data), JsonWriter()
                                                 .begin_object()
                                                 .pair("seen_ms", record.seen_ms)
                                                 .pair("claimed_ms", record.claimed_ms)
                                                 .pair("claimed_for_ms", record.claimed_for_ms)
                                                 .end_object()
                                                 .take());
}

Status accept_clock(const fs::path& data, int64_t wall_ms) {
  return write_file_atomic(data / kAcceptance, text("{}\n", wall_ms));
}

std::optional<int64_t> take_acceptance(const fs::path& data) {
  const fs::path file = data / kAcceptance;
  std::error_code code;
  if (!fs::exists(file, code)) return std::nullopt;
  const auto bytes = read_file(file, 64);
  fs::remove(file, code);
  if (!bytes || code) return std::nullopt;
  const auto* first = reinterpret_cast<const char*>(bytes->data());
  int64_t accepted = 0;
  const auto [stop, error] = std::from_chars(first, first + bytes->size(), accepted);
  if (error != std::errc() || accepted < 0 || accepted >= int64_t{1} << 60) return std::nullopt;
  return accepted;
}

std::string utc_text(int64_t unix_ms) {
  const auto seconds = static_cast<std::time_t>(unix_ms / 1000);
  std::tm utc{};
  char out[40];
  ::gmtime_r(&seconds, &utc);
  KILN_CHECK(std::strftime(out, sizeof out, "%Y-%m-%d %H:%M UTC", &utc) > 0);
  return out;
}

}  // namespace kiln
