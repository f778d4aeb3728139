#include "coordinator/run/time_budget.h"

#include <algorithm>

#include "common/base/parallel.h"

namespace kiln {
namespace {

// Seconds times threads: wall-clock time of each stage in report.json, times the number of threads
// (tests/bench/real_scenes.py, the largest maps).
constexpr double kDenoisePerSite[] = {10e-6, 4e-6, 2.4e-6, 1.0e-6};  // luminance only, indexed by levels
constexpr double kDenoisePerSmallSite = 5.5e-6;                      // on surfaces too small to join texels
constexpr double kNeighboursPerSite = 2e-6;                          // at least; more with many small charts
constexpr double kMinForPasses = 0.05;                               // share of the limit
constexpr double kPlanesShare = 2.5;        // time for all planes relative to luminance
constexpr double kViewsShare = 0.05;        // share of the limit
constexpr double kHiddenShare = 0.15;       // the same: what the cache leaks otherwise, no sample takes back
constexpr double kDenoiseShare = 0.15;      // maximum share of the limit: with less time it is coarser
constexpr double kFillPerSite = 3e-6;       // without the denoiser, which fills too
constexpr double kResolvePerSite = 1.0e-6;  // means, errors, fill and dilate
constexpr double kSeamsPerSite = 4e-6;
constexpr double kSeamsPerPoint = 4e-6, kTexturesPerSeamPoint = 4e-6;  // of both threads: the solve uses one
constexpr double kMastersPerTexel = 4e-6, kQuickMastersPerTexel = 1.4e-6;
constexpr double kTexturesPerTexel = 5.8e-6, kQuickTexturesPerTexel = 1.7e-6;  // per encoding
constexpr double kFilesShare =
    0.25;  // maximum share of the time after the layout; with less, files are written the quick way
constexpr double kResponseTexturePerTexel = 0.5e-6;  // per response and encoding
constexpr double kPlanesOfLight = 20;                // number of planes that light's masters count as
constexpr double kResponsePicture = 0.25;            // relative to the other pictures, per response
constexpr double kPictures = 0.5;                    // camera search: everything except pixels
constexpr double kPicturesPerPixel = 4.5e-6;
constexpr double kPage = 0.3;               // report.html
constexpr double kScenePerTriangle = 1e-6;  // scene.glb, one thread
constexpr double kPictureShare = 0.1;       // maximum share of the limit; pictures that take longer shrink
constexpr double kSeamsShare = 0.3;         // maximum share of the time left when the passes begin
// Left over for what no prediction covers: a share of the limit, or, if that is less, seconds and a smaller
// share.
constexpr double kMargin = 0.03, kMarginSeconds = 0.5, kMarginShare = 0.005;

// Seconds that a fixed amount of work takes on every thread at once: measures speed and load of this machine.
double probe_seconds() {
  const Stopwatch watch;
  parallel_for(hardware_threads(), [](size_t thread) {
    double x = 1.0 + static_cast<double>(thread);
    for (int i = 0; i < 4'000'000; ++i) x = x * 0.999999 + 1e-6;
    volatile double keep = x;
    static_cast<void>(keep);
  });
  return watch.seconds();
}
constexpr double kProbeSeconds = 0.0167;
// Relative to the idle machine on which the constants were measured.
double probed_slowness() {
  return std::clamp(probe_seconds() / kProbeSeconds, 0.9, 4.0);
}

}  // namespace

TimeBudget::TimeBudget(const BakeRequest& request, const Preflight& pre, const Stopwatch& watch)
    : request_(request),
      watch_(watch),
      sites_(static_cast<double>(pre.atlas.sites.size())),
      texels_(static_cast<double>(pre.atlas.texel_count())),
      triangles_(static_cast<double>(pre.imported.scene.triangle_count())),
      threads_(hardware_threads()),
      light_(request.settings.quantities.light),
      responses_(static_cast<double>(request.settings.quantities.responses.size())),
      denoises_(request.settings.denoise && light_) {
  for (const uint32_t response : request.settings.quantities.responses)
    response_planes_ += static_cast<double>(response_roster()[response].stored.size() + 1);
  if (request.settings.time_limit > 0) slowness_ = probed_slowness();
  choose_levels();
  quick_ = request.settings.time_limit > 0 &&
           textures_seconds(false) + masters_seconds() > kFilesShare * seconds_left();
}

void TimeBudget::choose_levels() {
  const double most = kDenoiseShare * request_.settings.time_limit;
  constexpr uint32_t kCoarsest = std::size(kDenoisePerSite) - 1;
  levels_ = 0;
  if (request_.settings.time_limit > 0)
    while (levels_ < kCoarsest && kPlanesShare * denoise_seconds(levels_) > most) ++levels_;
  last_levels_ = levels_;
}

bool TimeBudget::take_time_for_denoiser() {
  const double limit = request_.settings.time_limit;
  if (denoises_ && limit > 0) {
    const double neighbours = slowness_ * kNeighboursPerSite * sites_ / threads_;
    denoises_ = seconds_left() - least_seconds_after() - neighbours > kMinForPasses * limit;
  }
  return denoises_;
}

void TimeBudget::surface_is(double joined_share) {
  joined_share_ = joined_share;
  choose_levels();
}

double TimeBudget::views_seconds() const {
  const double limit = request_.settings.time_limit;
  return limit > 0 ? kViewsShare * limit : std::numeric_limits<double>::infinity();
}

double TimeBudget::hidden_seconds() const {
  const double limit = request_.settings.time_limit;
  return limit > 0 ? kHiddenShare * limit : std::numeric_limits<double>::infinity();
}

double TimeBudget::denoise_seconds(uint32_t levels) const {
  const double joined = kDenoisePerSite[std::min<size_t>(levels, std::size(kDenoisePerSite) - 1)];
  return slowness_ * denoise_slowness_ *
         (joined_share_ * joined + (1 - joined_share_) * kDenoisePerSmallSite) * sites_ / threads_;
}

void TimeBudget::seams_are(size_t points) {
  seam_points_ = static_cast<double>(points);
  // Sampling has priority over seams: if these would take most of the time left, they are not planned for.
  seams_ = seams_seconds() + textures_seconds(true) - textures_seconds(false) <= kSeamsShare * seconds_left();
}

// A slow run is due to this map or to a machine that is busier than before; only the latter slows the other
// stages too.
void TimeBudget::denoise_took(double seconds, uint32_t levels) {
  const double expected = denoise_seconds(levels);
  if (expected < 0.1 || seconds <= expected) return;
  const double slowness = slowness_ * denoise_slowness_ * seconds / expected;
  slowness_ = std::max(slowness_, probed_slowness());
  denoise_slowness_ = std::clamp(slowness / slowness_, denoise_slowness_, 4.0);
}

double TimeBudget::seams_seconds() const {
  if (!request_.settings.seams || !light_) return 0;
  return slowness_ * (kSeamsPerSite * sites_ / threads_ + kSeamsPerPoint * seam_points_);
}

double TimeBudget::textures_seconds(bool seams) const {
  double seconds = seams && request_.settings.seams ? slowness_ * kTexturesPerSeamPoint * seam_points_ : 0;
  for (const std::string& encoding : request_.settings.encodings)
    if (encoding != "none") {
      const double light = quick_ ? kQuickTexturesPerTexel : kTexturesPerTexel;
      seconds +=
          slowness_ * ((light_ ? light : 0) + responses_ * kResponseTexturePerTexel) * texels_ / threads_;
    }
  return seconds;
}

double TimeBudget::masters_seconds() const {
  constexpr double kSamplesAndValidity = 2;  // planes, if light's masters do not contain them
  const double share =
      (light_ ? 1 : kSamplesAndValidity / kPlanesOfLight) + response_planes_ / kPlanesOfLight;
  return slowness_ * (share * (quick_ ? kQuickMastersPerTexel : kMastersPerTexel) * texels_ / threads_ +
                      kScenePerTriangle * triangles_ + kPage);
}

double TimeBudget::pictures_seconds(double scale) const {
  const BakeSettings& s = request_.settings;
  if (!request_.pictures || !s.preview) return 0;
  const double pixels = scale * scale * s.preview_width * s.preview_height;
  const double pictures = 1 + kResponsePicture * responses_;
  return slowness_ * pictures * (kPictures + kPicturesPerPixel * pixels) / threads_;
}

// Stages that every map needs.
double TimeBudget::least_seconds_after() const {
  const double fill = (denoises_ ? kPlanesShare * denoise_seconds(last_levels_) : 0) +
                      (!denoises_ || responses_ > 0 ? slowness_ * kFillPerSite * sites_ / threads_ : 0);
  return fill + slowness_ * kResolvePerSite * sites_ / threads_ + textures_seconds(false) + masters_seconds();
}

double TimeBudget::seconds_after() const {
  if (!whole_) return least_seconds_after() + pictures_seconds(0.25);
  const double limit = request_.settings.time_limit;
  const double picture_share = limit > 0 ? kPictureShare * limit : std::numeric_limits<double>::infinity();
  const double pictures =
      quick_ ? pictures_seconds(0.25)
             : std::min(pictures_seconds(1), std::max(pictures_seconds(0.25), picture_share));
  const double seams = seams_ ? seams_seconds() + textures_seconds(true) - textures_seconds(false) : 0;
  return least_seconds_after() + seams + pictures;
}

double TimeBudget::seconds_left() const {
  const double limit = request_.settings.time_limit;
  if (limit <= 0) return std::numeric_limits<double>::infinity();
  return limit - std::min(kMargin * limit, kMarginSeconds + kMarginShare * limit) - watch_.seconds();
}

double TimeBudget::seconds_for_passes() const {
  return std::max(0.0, seconds_left() - seconds_after());
}

bool TimeBudget::has_time_for_seams() const {
  return seams_ && seams_seconds() + textures_seconds(true) + masters_seconds() <= seconds_left();
}

double TimeBudget::picture_scale() const {
  for (const double scale : {1.0, 0.5, 0.25})
    if ((whole_ || scale <= 0.25) && pictures_seconds(scale) <= seconds_left()) return scale;
  return 0;
}

}  // namespace kiln
