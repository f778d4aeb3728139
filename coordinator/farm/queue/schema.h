// The tables, and the migration of older databases.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/status.h"
#include "coordinator/farm/queue/sqlite.h"

namespace kiln {

inline constexpr uint32_t kStoreApplication = 0x4b494c4e;  // "KILN", in the header of the file

// ROOM: to change the tables, append the SQL that migrates version i to i + 1. Never change a released entry.
std::span<const char* const> store_schema();

// Fails (kUsage) if the file at `path` was written by a newer schema, (kIo) if it is not one of our stores.
// Reads the header only; a missing or empty file is fine.
Status check_schema(const std::filesystem::path& path, uint32_t version);

// Brings the database to the last of `steps` in one transaction.
Status migrate(Database& database, std::span<const char* const> steps);

}  // namespace kiln
