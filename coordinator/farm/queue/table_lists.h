// Serialises a record's lists into one column: u64 count, then the elements (common/base/bytes.h).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

Bytes write_list(const std::vector<JobId>& ids);
Bytes write_list(const std::vector<FileRecord>& files);
Bytes write_list(const std::vector<std::string>& texts);

// False if the bytes are not such a list.
bool read_list(std::span<const std::byte> bytes, std::vector<JobId>& ids);
bool read_list(std::span<const std::byte> bytes, std::vector<FileRecord>& files);
bool read_list(std::span<const std::byte> bytes, std::vector<std::string>& texts);

}  // namespace kiln
