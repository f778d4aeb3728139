// How large a data folder is, by kind, how fast it grows, and what is deleted next.
//
// Growth is counted over the time that the coordinator has observed (observed_time.h), from samples that are
// an hour apart and a week old at most, kept in the file `growth` of the data folder.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "coordinator/farm/queue/records.h"

namespace kiln {

// Bytes.
struct DataSizes {
  uint64_t inputs = 0;     // files of submitted scenes, each once
  uint64_t published = 0;  // results of jobs that are done, unless they are inputs too
  uint64_t spool = 0;      // results of units
  uint64_t database = 0;   // with its log
  uint64_t damaged = 0;    // files that were set aside
  uint64_t total() const { return inputs + published + spool + database + damaged; }
  bool operator==(const DataSizes&) const = default;
};

// ROOM: a kind is a member of DataSizes and its line here.
struct DataKind {
  const char* name;
  uint64_t DataSizes::*bytes;
};
inline constexpr std::array<DataKind, 5> kDataKinds = {{{"inputs", &DataSizes::inputs},
                                                        {"published", &DataSizes::published},
                                                        {"spool", &DataSizes::spool},
                                                        {"database", &DataSizes::database},
                                                        {"damaged", &DataSizes::damaged}}};

// Inputs and results by the records, the rest by the files. Uploads under way are left out.
DataSizes measure_data_folder(const std::filesystem::path& data, const std::vector<JobRecord>& jobs);

class GrowthHistory {
 public:
  static constexpr int64_t kEveryMs = 3'600'000, kKeepMs = int64_t{7} * 86'400'000;
  struct Sample {
    int64_t at_ms = 0;  // observed
    DataSizes sizes;
    bool operator==(const Sample&) const = default;
  };

  // Keeps the sample if it is the first, or an hour younger than the last; true: it was kept.
  bool add(int64_t at_ms, const DataSizes& sizes);
  // Since the oldest sample, by kind, bytes a day; nullopt within an hour of it.
  std::optional<std::array<double, kDataKinds.size()>> a_day(int64_t now_ms, const DataSizes& now) const;
  const std::vector<Sample>& samples() const { return samples_; }  // oldest first

 private:
  std::vector<Sample> samples_;
};

// A missing or damaged file gives an empty history.
GrowthHistory read_growth(const std::filesystem::path& data);
Status write_growth(const std::filesystem::path& data, const GrowthHistory& history);

// What grows old first: the jobs of the first day on which any are forgotten.
struct NextDeletion {
  int64_t at_ms = 0;        // of the first; 0: no job has ended
  std::vector<JobId> jobs;  // by id
  uint64_t bytes = 0;       // of files that no other job references
};
NextDeletion next_deletion(const std::vector<JobRecord>& jobs, int64_t keep_ms);

// The growth of the whole folder fills what is free in so many days; nullopt: it does not grow.
std::optional<double> days_until_full(uint64_t free_bytes, double bytes_a_day);

}  // namespace kiln
