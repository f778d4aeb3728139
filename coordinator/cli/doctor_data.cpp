// Checks of a coordinator's data folder on this machine, whether the coordinator runs or not.
#include <ctime>

#include "common/base/format.h"
#include "coordinator/cli/doctor_steps.h"
#include "coordinator/farm/queue/observed_time.h"

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

}  // namespace kiln
