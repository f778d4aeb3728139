// Record format and file names of the spool.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>

#include "coordinator/farm/queue/records.h"
#include "coordinator/farm/queue/spool.h"

namespace kiln {

// Little-endian: u32 magic "KSPR", u16 format, u16 size of this head, u64 job, u64 unit, u64 shape, u32
// length of the payload, u32 zero, 32 bytes digest of the result, u64 XXH3 of the payload, u64 XXH3 of the
// head before it.
std::array<std::byte, kSpoolHead> write_spool_head(const UnitCommit& commit,
                                                   std::span<const std::byte> payload);

std::filesystem::path spool_folder(const std::filesystem::path& folder, JobId job);
std::filesystem::path spool_path(const std::filesystem::path& folder, const SpoolFileId& id);
// Inverse of spool_path(); nullopt for other names.
std::optional<JobId> spool_job(const std::filesystem::path& folder);  // the job of spool_folder()
std::optional<SpoolFileId> spool_id(const std::filesystem::path& path);

}  // namespace kiln
