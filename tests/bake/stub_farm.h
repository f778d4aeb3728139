// A farm for tests of the conductor: no process and no ray. It answers as it is told and keeps what it was
// asked for, pass after pass.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <thread>

#include "common/math/sequence.h"
#include "common/responses/quantities.h"
#include "coordinator/run/bake_run.h"
#include "tests/bake/scene_gltf.h"

namespace kiln::test {

// What a farm was asked for and what it does about it. Outlives the job.
struct Stub {
  // Luminance of a sample; E is once, twice and three times that.
  std::function<double(uint32_t site, uint32_t replicate, uint32_t sample)> light;
  double drawn = 0;                 // every error drawn of a sample
  uint32_t drawn_from = 0;          // of this site and those after it
  size_t drawn_until = ~size_t{0};  // until this call of run_pass, and a quarter of it from there
  size_t rewind_at = ~size_t{0};    // call of run_pass that revokes all, when half its units are there
  size_t time_up_at = ~size_t{0};   // call that ends without a result
  size_t late_at = ~size_t{0};      // call that takes kLate
  double seconds = 0;               // of a worker for a sample, as it says
  std::vector<std::vector<WorkUnit>> calls;
  std::map<Digest, Bytes> chunks;
};

inline constexpr std::chrono::seconds kLate(5);

class StubJob final : public FarmJob {
 public:
  StubJob(Stub& stub, const JobSpec& spec)
      : stub_(stub),
        layout_(spec.transport.basis, spec.transport.quantities),
        planes_(static_cast<uint32_t>(layout_.planes())) {}
  Digest add_chunk(Bytes bytes) override {
    const Digest id = sha256(bytes);
    stub_.chunks[id] = std::move(bytes);
    return id;
  }
  Expected<PassEnd> run_pass(std::vector<WorkUnit> units, int64_t, const PassHandlers& handlers) override {
    const size_t call = stub_.calls.size();
    stub_.calls.push_back(units);
    if (call == stub_.time_up_at) return PassEnd::kTimeUp;
    const size_t answered = call == stub_.rewind_at ? units.size() / 2 : units.size();
    for (size_t i = 0; i < answered; ++i) KILN_TRY_STATUS(handlers.on_result(units[i], answer(units[i])));
    if (call == stub_.late_at) std::this_thread::sleep_for(kLate);
    return call == stub_.rewind_at ? PassEnd::kRewound : PassEnd::kComplete;
  }
  FarmStatistics statistics() override {
    FarmStatistics all;
    for (const auto& call : stub_.calls)
      for (const WorkUnit& unit : call)
        all.worker_seconds += stub_.seconds * unit.sample_count * static_cast<double>(unit.sites.size());
    return all;
  }

 private:
  UnitResult answer(const WorkUnit& unit) const {
    UnitResult r;
    r.unit = unit.id;
    r.site_count = static_cast<uint32_t>(unit.sites.size());
    r.plane_count = planes_;
    r.moments.assign(unit.sites.size() * planes_, 0.0);
    for (size_t i = 0; i < unit.sites.size(); ++i) {
      double* sums = &r.moments[i * planes_];
      for (uint32_t k = 0; k < unit.sample_count; ++k) {
        const double light = stub_.light(unit.sites[i], unit.replicate, unit.first_sample + k);
        for (size_t c = 0; c < 3; ++c) sums[kMomentER + c] += static_cast<double>(c + 1) * light;
        sums[kMomentLum] += light;
        sums[kMomentLum2] += light * light;
      }
      for (size_t k = 0; layout_.quantities().cache_draws && k < kCacheDraws; ++k)
        sums[layout_.cache_draws() + k] = drawn_of(unit, unit.sites[i]);
    }
    return r;
  }

  double drawn_of(const WorkUnit& unit, uint32_t site) const {
    if (site < stub_.drawn_from) return 0;
    return unit.sample_count * (stub_.calls.size() > stub_.drawn_until ? 0.25 : 1) * stub_.drawn;
  }

  Stub& stub_;
  const MomentLayout layout_;
  const uint32_t planes_;
};

inline double noisy(uint32_t site, uint32_t replicate, uint32_t sample) {
  return 2.0 * unit_float(static_cast<uint32_t>(
                   mix_bits((uint64_t{site} << 32 | sample) * kReplicates + replicate)));
}

// The order in which units are handed out is free.
inline std::vector<WorkUnit> by_number(std::vector<WorkUnit> units) {
  std::sort(units.begin(), units.end(), [](const WorkUnit& a, const WorkUnit& b) { return a.id < b.id; });
  return units;
}

class Passes : public testing::Test {
 protected:
  Passes() {
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    request_.scene = dir_.path() / "room.glb";
    request_.pictures = false;
    request_.settings.layout = "pack";
    request_.settings.texels_per_metre = 3;
    request_.settings.denoise = false;
    request_.settings.cache = true;
    // As a farm answers that has begun the job before: how fast answers come must not matter here.
    request_.cut = [](uint32_t, uint32_t) { return 64u; };
  }
  BakeReport bake(Stub& stub) {
    request_.output = dir_.path() / ("out" + std::to_string(++count_));
    request_.open_job = [&](const JobSpec& spec, const ChunkStore&) -> Expected<std::unique_ptr<FarmJob>> {
      return std::make_unique<StubJob>(stub, spec);
    };
    const auto report = run_bake(request_, [](const auto&) {});
    if (!report) throw std::runtime_error(report.error().message);
    return *report;
  }
  static std::map<std::string, std::string> masters(const BakeReport& report) {
    std::map<std::string, std::string> out;
    for (const OutputFile& f : report.outputs)
      if (f.master) out[f.name] = f.digest.hex();
    return out;
  }

  // A large map under even light, to an error that few samples have.
  BakeReport bake_even_light(double texels_per_metre, Stub& stub) {
    request_.settings.basis = "irradiance";
    request_.settings.encodings.clear();
    request_.settings.texels_per_metre = texels_per_metre;
    request_.settings.denoise = true;
    request_.settings.error = 0.4;
    stub.light = [](uint32_t, uint32_t, uint32_t) { return 1.0; };
    return bake(stub);
  }

  // Of the room, with the present settings.
  size_t room_sites() {
    Stub stub;
    stub.light = noisy;
    bake(stub);
    return sites_of(stub.calls[0]);
  }
  static size_t sites_of(const std::vector<WorkUnit>& all) {
    size_t sites = 0;
    for (const WorkUnit& unit : all)
      if (unit.replicate == 0) sites += unit.sites.size();
    return sites;
  }

  // Passes whose samples are in no texel; they come first.
  static size_t dropped(const BakeReport& report) {
    size_t n = 0;
    while (n < report.passes.size() && !report.passes[n].kept) ++n;
    return n;
  }

  TempDir dir_;
  int count_ = 0;
  BakeRequest request_;
};

}  // namespace kiln::test
