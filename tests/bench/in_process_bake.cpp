// in_process_bake SCENE OUT THREADS [NAME=VALUE ...]: the bake of `kiln bake` without workers: the same
// stages, passes and units, baked by threads of this process and merged as they come. tests/bench/overhead.py
// holds the time of `kiln bake` against it. NAME=VALUE: settings by their names of the job file.
#include <condition_variable>
#include <cstdio>
#include <map>
#include <mutex>
#include <queue>
#include <thread>

#include "common/base/clock.h"
#include "coordinator/run/bake_run.h"
#include "worker/bake/baker.h"

namespace kiln {
namespace {

class InProcessJob final : public FarmJob {
 public:
  static Expected<std::unique_ptr<FarmJob>> open(const JobSpec& spec, const ChunkStore& chunks,
                                                 unsigned threads) {
    const auto find = [&](const Digest& id) { return chunks.find(id); };
    KILN_TRY(Scene scene, read_scene(*find(spec.scene), find));
    KILN_TRY(Atlas atlas, read_atlas(*find(spec.atlas), scene));
    KILN_TRY(auto baker, Baker::create(std::move(scene), std::move(atlas), spec.transport, threads));
    return std::unique_ptr<FarmJob>(new InProcessJob(std::move(baker), threads));
  }

  Digest add_chunk(Bytes bytes) override {
    const Digest id = sha256(bytes);
    added_.emplace(id, std::move(bytes));
    return id;
  }

  Expected<PassEnd> run_pass(std::vector<WorkUnit> units, int64_t, const PassHandlers& handlers) override {
    std::map<Digest, IrradianceCache> caches;
    for (const WorkUnit& unit : units)
      if (unit.cache != Digest{} && !caches.count(unit.cache)) {
        KILN_TRY(caches[unit.cache], read_irradiance_cache(added_.at(unit.cache), baker_->sites()));
      }
    std::erase_if(added_, [&](const auto& entry) { return !caches.count(entry.first); });
    std::mutex mutex;
    std::condition_variable came;
    std::queue<std::pair<size_t, Expected<UnitResult>>> results;
    size_t next = 0;
    std::vector<std::jthread> pool;
    for (unsigned t = 0; t < threads_; ++t)
      pool.emplace_back([&] {
        for (;;) {
          std::unique_lock lock(mutex);
          if (next == units.size()) return;
          const size_t i = next++;
          lock.unlock();
          const auto cache = caches.find(units[i].cache);
          Expected<UnitResult> result =
              baker_->bake(units[i], cache == caches.end() ? nullptr : &cache->second);
          lock.lock();
          results.emplace(i, std::move(result));
          came.notify_one();
        }
      });
    const auto drop_the_rest = [&] {
      const std::lock_guard lock(mutex);
      next = units.size();
    };
    for (size_t done = 0; done < units.size(); ++done) {
      std::unique_lock lock(mutex);
      came.wait(lock, [&] { return !results.empty(); });
      const auto [i, result] = std::move(results.front());
      results.pop();
      lock.unlock();
      Status merged = result ? handlers.on_result(units[i], *result) : tl::unexpected<Error>(result.error());
      if (!merged) {
        drop_the_rest();
        return tl::unexpected<Error>(merged.error());
      }
      statistics_.rays += result->rays;
      ++statistics_.units;
      statistics_.worker_seconds += result->seconds;
    }
    return PassEnd::kComplete;
  }
  FarmStatistics statistics() override { return statistics_; }

 private:
  InProcessJob(std::unique_ptr<Baker> baker, unsigned threads)
      : baker_(std::move(baker)), threads_(threads) {}
  std::unique_ptr<Baker> baker_;
  unsigned threads_;
  std::map<Digest, Bytes> added_;
  FarmStatistics statistics_;
};

Status bake(int argc, char** argv) {
  if (argc < 4) return fail(ErrorKind::kUsage, "in_process_bake SCENE OUT THREADS [NAME=VALUE ...]");
  BakeRequest request;
  request.scene = argv[1];
  request.output = argv[2];
  const auto threads = static_cast<unsigned>(std::stoul(argv[3]));
  for (int i = 4; i < argc; ++i) {
    const std::string entry = argv[i];
    const size_t equals = entry.find('=');
    if (equals == std::string::npos) return fail(ErrorKind::kUsage, entry + ": NAME=VALUE is wanted");
    KILN_TRY_STATUS(
        set_option(request.settings, entry.substr(0, equals), entry.substr(equals + 1), "command line"));
  }
  KILN_TRY_STATUS(check_settings(request.settings));
  request.open_job = [&](const JobSpec& spec, const ChunkStore& chunks) {
    return InProcessJob::open(spec, chunks, threads);
  };
  const Stopwatch watch;
  KILN_TRY(const BakeReport report, run_bake(request, [](const BakeProgress&) {}));
  std::printf("%.3f s, %llu rays\n", watch.seconds(), static_cast<unsigned long long>(report.farm.rays));
  return {};
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  const kiln::Status done = kiln::bake(argc, argv);
  if (!done) std::fprintf(stderr, "%s\n", done.error().message.c_str());
  return done ? 0 : 1;
}
