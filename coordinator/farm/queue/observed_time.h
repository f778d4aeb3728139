// Time as the store has observed it, from which ages of ended jobs and blobs are counted: a clock that is
// wrong at a start, or is set wrong later, must not make everything old at once.
//
// A pure function of readings of the wall clock and the steady clock. It follows the wall clock while that
// goes on from where it was seen last. A reading more than a day beyond that is doubted: then time goes on by
// the steady clock alone, and nothing may be collected until the clock has gone on evenly for a day of
// running, a person has accepted it, or it has come back. It never goes backwards.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/base/status.h"

namespace kiln {

// What is kept on disk, Unix ms; zeros: nothing yet.
struct ClockRecord {
  int64_t seen_ms = 0;         // the time as observed
  int64_t claimed_ms = 0;      // a doubted reading; 0: no doubt
  int64_t claimed_for_ms = 0;  // how long the clock has gone on evenly from there while a coordinator ran
  bool operator==(const ClockRecord&) const = default;
};

class ObservedTime {
 public:
  static constexpr int64_t kLeapMs = 86'400'000;     // a longer leap is doubted
  static constexpr int64_t kConfirmMs = 86'400'000;  // of running, after which it is believed

  ObservedTime() = default;
  // `record`: of the last coordinator. Without one, `newest_ms` is the newest time in the store's records; 0:
  // none, and the first reading is believed.
  ObservedTime(const ClockRecord& record, int64_t newest_ms, int64_t wall_ms, int64_t steady_ms);

  void observe(int64_t wall_ms, int64_t steady_ms);
  void accept();  // the last reading is right
  int64_t now_ms() const { return record_.seen_ms; }
  bool doubted() const { return record_.claimed_ms != 0; }
  const ClockRecord& record() const { return record_; }

 private:
  ClockRecord record_;
  int64_t wall_ms_ = 0, steady_ms_ = 0;  // the last readings
};

// The file `clock` of a data folder. A missing or damaged one gives zeros.
ClockRecord read_clock(const std::filesystem::path& data);
Status write_clock(const std::filesystem::path& data, const ClockRecord& record);

// A person's word that the clock is right, left for the coordinator of a data folder, whether it runs or not.
Status accept_clock(const std::filesystem::path& data, int64_t wall_ms);
std::optional<int64_t> take_acceptance(
    const std::filesystem::path& data);  // once; the clock as it was accepted

// "2027-03-01 12:00 UTC"
std::string utc_text(int64_t unix_ms);

}  // namespace kiln
