#include "coordinator/bake/sampling/pace.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kiln {
namespace {

constexpr double kUnitSeconds = 1;     // on one thread: long beside a message, short beside a lost machine
constexpr double kUnitsPerThread = 8;  // at least, in each pass, so that its end does not wait for one thread
// The last pass's speed counts as this share of the present one. Units of the most gain come first and take
// longest, and the first results come late: alone, a few hundredths of a pass foretold up to twice the time.
constexpr double kLastPass = 0.1;
constexpr double kFirstShare = 0.02;  // less of the first pass foretells nothing

}  // namespace

void BakePace::set_limit(double seconds) {
  if (std::isfinite(seconds))
    deadline_ms_ = clock_.now_ms() + static_cast<int64_t>(std::clamp(seconds, 0.0, 1e9) * 1000);
}

uint32_t BakePace::unit_texels(double samples, uint32_t first) const {
  if (unit_seconds_ <= 0) return first;
  const double texel_seconds = unit_seconds_ / unit_texels_;  // a unit is texels x 256 samples
  const double seconds =
      std::clamp(texel_seconds * samples / 256 / (kUnitsPerThread * threads_), 0.02, kUnitSeconds);
  const double texels = std::clamp(seconds / texel_seconds, unit_texels_ / 4.0, unit_texels_ * 4.0);
  return static_cast<uint32_t>(std::clamp(texels, 16.0, 8192.0));
}

void BakePace::begin_pass(double samples, double later, double passes) {
  began_ = seconds();
  samples_ = samples;
  later_ = later;
  passes_ = passes;
}

void BakePace::end_pass(uint32_t unit_texels, uint64_t units, double worker_seconds) {
  ended_ = seconds();
  const double took = ended_ - began_;
  if (took > 0) speed_ = samples_ / took;
  unit_texels_ = unit_texels;
  if (units > 0) unit_seconds_ = worker_seconds / static_cast<double>(units);
}

double BakePace::seconds_left(double done) const {
  const double last = speed_ > 0 ? kLastPass : 0;
  if (later_ < 0 || !(done + last > kFirstShare)) return -1;
  const double took = seconds() - began_ + (last > 0 ? last * samples_ / speed_ : 0);
  const double baking = took / (done + last) * (1 - done + later_ / std::max(1.0, samples_));
  return std::min(baking + (1 + passes_) * barrier_, std::max(0.0, limit_left()));
}

double BakePace::seconds_for(double samples, double passes) const {
  if (speed_ <= 0) return -1;
  return std::min(samples / speed_ + passes * barrier_, std::max(0.0, limit_left()));
}

double BakePace::limit_left() const {
  return deadline_ms_ ? static_cast<double>(deadline_ms_ - clock_.now_ms()) / 1000
                      : std::numeric_limits<double>::infinity();
}

}  // namespace kiln
