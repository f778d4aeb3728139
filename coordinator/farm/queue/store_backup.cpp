// The store's part of a backup: all that must be of one moment.
#include <unistd.h>

#include "coordinator/farm/queue/store_impl.h"

namespace kiln {
namespace fs = std::filesystem;

Expected<std::vector<JobRecord>> StoreImpl::copy_now(const fs::path& database, const fs::path& links) {
  std::vector<JobRecord> jobs;
  Operation operation;
  operation.reads = true;
  operation.after = [&]() -> Status {
    KILN_TRY_STATUS(writer_.database().copy_to(database));
    for (const fs::path& job : list_folder(spool_))
      for (const fs::path& file : list_folder(job)) {
        const fs::path link = links / job.filename() / file.filename();
        KILN_TRY_STATUS(make_folder(real_disk_calls(), link.parent_path()));
        if (::link(file.c_str(), link.c_str()) != 0) return system_error("link", link);
      }
    jobs = cache_.jobs();
    return {};
  };
  KILN_TRY_STATUS(writer_.give_and_wait(std::move(operation)));
  return jobs;
}

}  // namespace kiln
