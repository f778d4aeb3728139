// Settings of a bake as they travel and are kept: an object of names and texts, or lists of texts for options
// that may be given several times.
#pragma once

#include <string>
#include <vector>

#include "common/job/settings.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

// Those that somebody set.
std::string write_job_settings(const BakeSettings& settings);
// Fails (kInvalidInput) naming the setting; options that name a file must name one of the inputs, and no
// other path of the coordinator's machine is taken.
Expected<BakeSettings> read_job_settings(const std::string& document, const std::vector<FileRecord>& inputs);

}  // namespace kiln
