#include "tests/queue/samples.h"

#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <fstream>

namespace kiln::test {

MemoryDir::MemoryDir() {
  const bool memory = ::access("/dev/shm", W_OK) == 0;
  std::string name =
      (memory ? "/dev/shm" : std::filesystem::temp_directory_path().string()) + "/kiln-test-XXXXXX";
  if (::mkdtemp(name.data())) path_ = name;
}

MemoryDir::~MemoryDir() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

JobRecord sample_job(const std::string& name) {
  JobRecord job;
  job.name = name;
  job.user = "ada";
  job.priority = -7;
  job.state = JobState::kBaking;
  job.paused = true;
  job.reason = "two workers bake it";
  job.quorum = 2;
  job.poison = PoisonPolicy::kSkip;
  job.settings = R"({"error": 0.02})";
  job.inputs = {{"room.gltf", sha256(bytes_of("room")), 4}, {"textures/a b.png", sha256(bytes_of("png")), 3}};
  job.scene = "room.gltf";
  static std::atomic<uint64_t> drawn = 0;  // the same twice would be one job
  job.submission = std::to_string(::getpid()) + "-" + std::to_string(++drawn);
  job.numeric_class = "avx2 1234";
  job.preparations = 3;
  job.submitted_ms = 1700000000123;
  job.started_ms = job.submitted_ms + 5;
  job.ended_ms = job.submitted_ms + 50;
  job.passes_done = 4;
  job.units_done = uint64_t{1} << 40;
  job.units_total = ~uint64_t{0};
  job.texels = 99;
  job.worst_relative_error = 0.1;
  job.converged_share = 1.0 / 3;
  job.results = {{"scene.glb", sha256(bytes_of("glb")), uint64_t{1} << 33}};
  job.tainted = true;
  job.taint = "unit 5 was skipped";
  return job;
}

Bytes sample_payload(uint64_t unit, size_t size) {
  Bytes bytes(size);
  uint64_t state = unit * 2654435761u + 1;
  for (std::byte& byte : bytes) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    byte = static_cast<std::byte>(state >> 56);
  }
  return bytes;
}

UnitCommit sample_commit(JobId job, uint64_t unit, const Bytes& payload) {
  return {job, unit, unit * 31 + 7, sha256(payload), "worker-" + std::to_string(unit % 3), false};
}

void flip_bit(const std::filesystem::path& path) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const auto middle = static_cast<std::streamoff>(std::filesystem::file_size(path) / 2);
  file.seekg(middle);
  const int byte = file.get();
  file.seekp(middle);
  file.put(static_cast<char>(byte ^ 4));
  EXPECT_TRUE(file.good()) << path;
}

std::unique_ptr<Store> open_store(const std::filesystem::path& folder, const StoreOptions& options) {
  auto store = Store::open(folder, options);
  if (!store) {
    ADD_FAILURE() << store.error().message;
    return nullptr;
  }
  return std::move(*store);
}

std::vector<CommitRow> rows_of(Store& store, JobId job) {
  auto rows = store.commits(job);
  if (rows) return std::move(*rows);
  ADD_FAILURE() << rows.error().message;
  return {};
}

Status commit_now(Store& store, const UnitCommit& commit, const Bytes& payload) {
  return wait_for(
      [&](auto done) { store.commit_result(commit, std::make_shared<const Bytes>(payload), done); });
}

Status commit_now(Store& store, JobId job, uint64_t unit, size_t size) {
  const Bytes payload = sample_payload(unit, size);
  return commit_now(store, sample_commit(job, unit, payload), payload);
}

}  // namespace kiln::test
