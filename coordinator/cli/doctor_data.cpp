// Checks of a coordinator's data folder on this machine, whether the coordinator runs or not.
#include <map>

#include "common/base/format.h"
#include "coordinator/cli/doctor_steps.h"
#include "coordinator/farm/queue/backup.h"
#include "coordinator/farm/queue/blobs.h"
#include "coordinator/farm/queue/observed_time.h"
#include "coordinator/farm/queue/store.h"

namespace kiln {

DoctorStep look_at_kept_clock(const std::string& data, int64_t wall_ms, bool accept) {
  DoctorStep step{"retention", "", true, ""};
  if (accept) {
    const Status said = accept_clock(data, wall_ms);
    step.good = said.has_value();
    step.finding =
        said ? text("{} is accepted: the coordinator believes it within seconds, or at its next start",
                    utc_text(wall_ms))
             : said.error().message;
    step.remedy = said ? "" : "run it as the coordinator's user, on a disk with space";
    return step;
  }
  const ClockRecord record = read_clock(data);
  if (!record.seen_ms) {
    step.finding = "no coordinator has kept the time here yet";
    return step;
  }
  const ObservedTime time(record, 0, wall_ms, 0);
  step.good = !time.doubted();
  step.finding =
      text("the clock reads {}, the coordinator saw {} last", utc_text(wall_ms), utc_text(record.seen_ms));
  if (step.good) return step;
  step.finding += ": it doubts a leap of more than a day, and deletes nothing for its age";
  step.remedy = text(
      "if the clock is right: kiln doctor --data {} --accept-clock (or a day of running); else set it", data);
  return step;
}

namespace {

std::vector<std::string> damaged_files(const std::vector<JobRecord>& jobs, BlobStore& blobs) {
  std::map<Digest, BlobState> states;
  std::vector<std::string> faults;
  for (const JobRecord& job : jobs)
    for (const auto* files : {&job.inputs, &job.results})
      for (const FileRecord& file : *files) {
        const auto [at, is_new] = states.emplace(file.digest, BlobState::kMissing);
        if (is_new)
          if (const auto state = blobs.verify(file.digest)) at->second = *state;
        if (at->second == BlobState::kIntact) continue;
        faults.push_back(text("{} {} of job {} is {} (blob {})", files == &job.inputs ? "input" : "result",
                              file.path, job.id, at->second == BlobState::kDamaged ? "damaged" : "missing",
                              file.digest.hex()));
      }
  return faults;
}

}  // namespace

DoctorStep look_at_store(const std::string& data) {
  DoctorStep step{"store", "", false, ""};
  std::error_code code;
  if (!std::filesystem::exists(std::filesystem::path(data) / "kiln.db", code)) {
    step.finding = text("{} holds no kiln.db", data);
    step.remedy = "give the folder that `kiln serve --data` uses";
    return step;
  }
  const auto store = Store::open(data, {});
  if (!store) {
    step.finding = store.error().message;
    step.remedy =
        "a running coordinator reads all by itself once a week (`kiln serve --scrub`); its log says what it "
        "finds. Stop it to have all read now";
    return step;
  }
  const auto blobs = BlobStore::open(std::filesystem::path(data) / "blobs", {});
  const auto faults = (*store)->check();
  if (!faults || !blobs) {
    step.finding = faults ? blobs.error().message : faults.error().message;
    step.remedy = "restore the folder from a copy, or move it away to begin anew";
    return step;
  }
  std::vector<std::string> all = *faults;
  for (std::string& fault : damaged_files((*store)->jobs(), **blobs)) all.push_back(std::move(fault));
  step.good = all.empty();
  step.finding =
      text("{} jobs, {} MiB of their files read", (*store)->jobs().size(), (*blobs)->verified().bytes >> 20);
  if (step.good) return step;
  for (size_t i = 0; i < all.size() && i < 10; ++i) step.finding += "; " + all[i];
  if (all.size() > 10) step.finding += text("; and {} more", all.size() - 10);
  step.remedy =
      "look after the disk. The coordinator bakes damaged results again by itself; scenes whose inputs are "
      "damaged or missing must be submitted again";
  return step;
}

DoctorStep look_at_backup(const std::string& folder) {
  if (!is_whole_backup(folder))
    return {"backup", text("{} holds no backup that was finished", folder), false,
            "make one: kiln backup --data DIR -o DEST"};
  DoctorStep step = look_at_store(folder);
  step.name = "backup";
  if (!step.good) step.remedy = "make another backup, and look after this disk";
  return step;
}

}  // namespace kiln
