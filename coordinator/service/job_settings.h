// The transport and storage form of bake settings: an object of names and strings, or lists of
// strings for options that may be given several times.
#pragma once

#include <string>
#include <vector>

#include "common/job/settings.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

// Only settings that were set by somebody.
std::string write_job_settings(const BakeSettings& settings);
// The settings of such an object; the paths in it are taken as they are. Fails (kInvalidInput) naming the
// setting.
Expected<BakeSettings> read_written_settings(const std::string& document);
// Fails (kInvalidInput) naming the setting. Options that name a file must name one of the inputs;
// no other path on the coordinator's machine is accepted.
Expected<BakeSettings> read_job_settings(const std::string& document, const std::vector<FileRecord>& inputs);

}  // namespace kiln
