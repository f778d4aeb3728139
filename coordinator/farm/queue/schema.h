// The tables and how a database of an older release becomes one of this.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/status.h"
#include "coordinator/farm/queue/sqlite.h"

namespace kiln {

inline constexpr uint32_t kStoreApplication = 0x4b494c4e;  // "KILN", in the header of the file

// ROOM: a change of the tables is one more text here: what makes version i + 1 out of version i. Never change
// one that was released.
std::span<const char* const> store_schema();

// Fails (kUsage) if the file at `path` was written by a newer schema, (kIo) if it is no store of ours. Reads
// the header only; a file that is not there, or has no bytes yet, is well.
Status check_schema(const std::filesystem::path& path, uint32_t version);

// Brings the database to the last of `steps` in one transaction.
Status migrate(Database& database, std::span<const char* const> steps);

}  // namespace kiln
