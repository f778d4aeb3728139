#include "coordinator/run/time_budget.h"

#include <algorithm>

#include "common/base/parallel.h"

namespace kiln {
namespace {

// Seconds of one thread, measured by tests/bench/real_scenes.py (cpu_seconds of stages in report.json).
constexpr double kNeighboursPerSite = 1.5e-6;
constexpr double kLuminancePerSite = 16e-6;  // one run of the denoiser over luminance
constexpr double kPlanesShare = 1.5;         // its run over all planes, by that
constexpr double kResolvePerSite = 1.5e-6;   // means, errors, fill and dilate
constexpr double kSeamsPerSite = 4e-6;
constexpr double kMastersPerTexel = 1.2e-6;
constexpr double kTexturesPerTexel = 4e-6;  // of one encoding
constexpr double kPictures = 1.0;           // of full size
constexpr double kPage = 0.3;               // report.html, scene.glb
constexpr double kMargin = 0.02;            // of the limit

}  // namespace

TimeBudget::TimeBudget(const BakeRequest& request, const Preflight& pre, const Stopwatch& watch)
    : request_(request),
      watch_(watch),
      sites_(static_cast<double>(pre.atlas.sites.size())),
      texels_(static_cast<double>(pre.atlas.texel_count())),
      threads_(hardware_threads()) {
  denoise_ = kLuminancePerSite * sites_ / threads_;
}

void TimeBudget::neighbours_took(double seconds) {
  const double expected = kNeighboursPerSite * sites_ / threads_;
  if (!(expected > 0.01)) return;
  slowness_ = std::clamp(seconds / expected, 0.5, 4.0);
  denoise_ *= slowness_;
}

void TimeBudget::denoise_took(double seconds) {
  const double expected = kLuminancePerSite * sites_ / threads_;
  if (expected > 0.01) slowness_ = std::clamp(seconds / expected, 0.5, 4.0);
  denoise_ = seconds;
}

double TimeBudget::seconds_after() const {
  const BakeSettings& s = request_.settings;
  double thread_seconds = kResolvePerSite * sites_ + kMastersPerTexel * texels_ + kPage;
  if (s.seams) thread_seconds += kSeamsPerSite * sites_;
  for (const std::string& encoding : s.encodings)
    if (encoding != "none") thread_seconds += kTexturesPerTexel * texels_;
  if (request_.pictures) thread_seconds += kPictures;
  const double denoise = s.denoise ? kPlanesShare * denoise_ : 0;
  return denoise + slowness_ * thread_seconds / threads_;
}

double TimeBudget::seconds_left() const {
  const double limit = request_.settings.time_limit;
  if (limit <= 0) return std::numeric_limits<double>::infinity();
  return (1 - kMargin) * limit - watch_.seconds();
}

double TimeBudget::seconds_for_passes() const {
  return std::max(0.0, seconds_left() - seconds_after());
}

bool TimeBudget::has_time_for_pictures(double share) const {
  return share * share * kPictures * slowness_ <= seconds_left();
}

}  // namespace kiln
