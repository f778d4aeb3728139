#include "coordinator/run/baking.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/clock.h"
#include "common/base/format.h"
#include "common/base/statistics.h"
#include "coordinator/bake/merge/response_errors.h"
#include "coordinator/bake/sampling/allocation.h"
#include "coordinator/bake/sampling/cache_draws.h"
#include "coordinator/bake/sampling/first_look.h"
#include "coordinator/bake/sampling/pace.h"
#include "coordinator/bake/sampling/schedule.h"
#include "coordinator/bake/sampling/settling.h"
#include "coordinator/run/bake_caches.h"
#include "coordinator/run/bake_stages.h"
#include "coordinator/run/nonfinite.h"
#include "coordinator/run/skipped.h"
#include "coordinator/run/statement.h"

namespace kiln {
namespace {

constexpr uint32_t kLimitedPilot = 16;  // per replicate, of all looks, or of the pilot after them
constexpr double kPilotShare = 0.05;    // of the time left that whole paths may take after the first looks
constexpr uint32_t kFilterFrom = 8;     // samples per replicate from which passes use filtered errors
constexpr double kFilterShare = 0.1;    // share of the time left that filtering between passes may take
constexpr uint32_t kFirstSamples = 32;
constexpr size_t kRoughLooks = 2;       // number of looks followed by caches of partial data
constexpr uint32_t kMaxRounds = 4;      // of passes that only improve the cache
constexpr double kRoughCache = 0.1;     // rms relative error above which it is made again
constexpr double kSettled = 0.9;        // a better cache that leaves more of the error than this is no help
constexpr double kRoundShare = 0.25;    // share of all predicted samples that one round may take
constexpr double kMostUnsettled = 0.2;  // share of unsettled sites below which only those begin again
constexpr uint32_t kMaxPasses = 64;
constexpr double kRenewal = 1.5;  // caches are renewed once total samples have grown by this factor
constexpr double kSureToRenew = 2;
constexpr double kStragglers = 0.01;  // share of all samples so far
constexpr double kMinPassSeconds = 0.02;

class Baking {
 public:
  explicit Baking(const BakingTask& task)
      : request_(task.request),
        settings_(task.request.settings),
        farm_(task.farm),
        sums_(task.sums),
        report_(task.report),
        progress_(task.progress),
        surface_(task.surface),
        cache_(task.preflight.plan.cache),
        atlas_(task.preflight.atlas),
        nonfinite_(task.preflight.atlas, task.preflight.imported.scene),
        charts_(charts_of_sites(task.preflight.atlas)),
        caches_(atlas_, charts_, task.misleading, settings_.seed, task.farm),
        z_(normal_interval(settings_.confidence)),
        target_(settings_.quantities.light ? settings_.error : settings_.visibility_error),
        budget_(task.budget),
        pace_(task.budget.seconds_for_passes()),
        passes_before_(task.passes_before),
        units_before_(task.units_before),
        next_unit_(units_before_ + 1) {}

  Expected<Baked> run() {
    KILN_TRY(norm_, find_error_norm(settings_.error_norm));
    for (;;) {
      KILN_TRY(const PassEnd end, run_passes());
      if (end == PassEnd::kTimeUp) report_.complete = false;
      if (end != PassEnd::kRewound) break;
      sums_.clear();
      report_.passes.clear();
      nonfinite_.clear();
      next_unit_ = units_before_ + 1;
    }
    if (is_at_bound()) report_.complete = true;  // more time would change nothing
    report_.held_back = held_back();
    report_.nonfinite = nonfinite_.places();
    if (const std::string s = nonfinite_.sentence(); !s.empty()) report_.warnings.push_back(s);
    if (const std::string s = skipped_.sentence(); !s.empty()) report_.warnings.push_back(s);
    return Baked{std::move(errors_), std::move(response_errors_),
                 std::move(shared_), std::move(filters_),
                 unmet_.get(),       whole_};
  }

 private:
  Expected<PassEnd> run_passes() {
    takes_.assign(sums_.sites(), 0);
    skipped_.clear();
    sampled_ = pass_ = 0;
    caches_.begin();
    errors_ = {};
    shared_.clear();
    planned_.clear();
    response_errors_.clear();
    most_ = std::max(1u, settings_.most_samples() / kReplicates);
    least_ = (settings_.least_samples(sums_.sites(), cache_) + 1) / kReplicates;
    convergence_ = {};
    unmet_ = {};
    grew_ = settled_ = false;
    whole_ = true;
    later_ = -1;
    std::vector<SiteSamples> work;
    if (is_limited()) {
      KILN_TRY(const PassEnd end, first_looks(work));
      if (end != PassEnd::kComplete) return end;
    } else {
      // With caches a fixed count is reached in steps too, because the first cache is the roughest.
      work = all_sites({0, cache_ ? std::min(least_, kFirstSamples) : least_});
      if (cache_) {
        KILN_TRY(const PassEnd end, pilot(std::min(pilot_samples(sums_.sites()), least_),
                                          fills_between() ? pilot_stride(sums_.sites()) : 1, work));
        if (end != PassEnd::kComplete) return end;
      }
    }
    while (!work.empty() && pass_ < kMaxPasses) {
      KILN_TRY(const PassEnd end, run_pass(std::move(work)));
      record();
      if (end != PassEnd::kComplete) return end;
      KILN_TRY(const PassEnd planned, plan(work));
      if (planned != PassEnd::kComplete) return planned;
    }
    return PassEnd::kComplete;
  }

  // Leaves the next work in `work`, none if the bake is done.
  Expected<PassEnd> plan(std::vector<SiteSamples>& work) {
    if (!settled_) {
      settled_ = true;
      KILN_TRY(const PassEnd end, settle());
      if (end != PassEnd::kComplete) return end;
    }
    const bool old = !caches_.empty() && sampled_ > kRenewal * sampled_at_renewal_;
    if (old && is_limited()) renew_caches();  // first: it takes time that the plan must not spend
    if (work = next_work(); old && !is_limited() && !work.empty()) renew_caches();
    return PassEnd::kComplete;
  }

  // Takes again what sites have whose error is that of the caches. The map is filtered after the last round;
  // until then what is to come stays as foretold: old errors with new counts would foretell too many samples.
  Expected<PassEnd> settle() {
    Settling settling;
    SettlingState foretold = settling_state();
    const uint32_t first = pass_;
    PassEnd end = PassEnd::kComplete;
    while (end == PassEnd::kComplete && !caches_.empty() && pass_ < kMaxPasses) {
      foretold.shared = shared_;
      foretold.samples = samples_;
      foretold.to_come = std::min(foretold.to_come, affordable_samples());
      std::vector<SiteSamples> work = settling.next(foretold);
      skipped_.leave_out_of(work);
      if (work.empty()) break;
      foretell(samples_of(work), foretold.to_come);
      caches_.leave_out(settling.left_out());
      renew_caches();
      drop(work);
      KILN_TRY(end, run_pass(std::move(work)));
      record_round();
    }
    if (pass_ == first) return end;
    report_.passes.pop_back();
    grew_ = false;
    record();
    return end;
  }
  SettlingState settling_state() const {
    const SampleState now = state();
    const double to_come = missing_samples(all_needed(asked_error()), now, most_);
    return {shared_, samples_, most_, final_error() / z_, to_come, now.mean, least_mean(now, norm_)};
  }
  double affordable_samples() const { return pace_.limit_left() * pace_.samples_per_second(); }

  // Coarse to fine: one sample per replicate for a stride of the texels, then finer strides, then
  // all of them; from there samples double everywhere. Every pass uses the light that earlier ones
  // found. Leaves the next work in `work`, none if time is up.
  Expected<PassEnd> first_looks(std::vector<SiteSamples>& work) {
    const std::vector<std::vector<uint32_t>> looks = sites_by_look(atlas_);
    budget_.set_whole(false);
    for (size_t look = 0; look < looks.size(); ++look) {
      std::vector<SiteSamples> sites;
      for (const uint32_t site : looks[look])
        if (is_sampled(site)) sites.push_back({site, {0, 1}});
      if (sites.empty()) continue;
      KILN_TRY(const PassEnd end, run_pass(std::move(sites)));
      if (look + 1 == looks.size() || end != PassEnd::kComplete) record();
      if (end == PassEnd::kTimeUp && look == 0) whole_ = false;
      if (end != PassEnd::kComplete) return end;
      if (cache_ && look < kRoughLooks) caches_.make_rough(sums_, pass_, look_stride(look + 1));
    }
    budget_.set_whole(true);
    pace_.set_limit(budget_.seconds_for_passes());
    const uint32_t most = std::min(kLimitedPilot, most_);
    for (uint32_t have = 1;;) {
      if (cache_) renew_caches();
      if (have == most) break;
      const uint32_t to = std::min(2 * have, most);
      work = all_sites({have, to - have});
      if (samples_of(work) > affordable_samples()) break;
      KILN_TRY(const PassEnd end, run_pass(std::move(work)));
      record();
      if (end != PassEnd::kComplete) return end;
      have = to;
    }
    if (cache_ && has_time_for_caches(samples_.front(), all_sites({0, std::min(least_, kFirstSamples)}))) {
      work = all_sites({0, std::min(least_, kFirstSamples)});
      if (!has_time_for_whole_paths(most)) return make_caches(samples_.front(), work, 1);
      // A room hands on the error of the first caches, which were made of single samples, to all later ones.
      drop_all();
      caches_.clear();
      return pilot(most, 1, work);
    }
    return plan(work);
  }
  bool has_time_for_whole_paths(uint32_t count) const {
    const double samples = kReplicates * count * static_cast<double>(sums_.sites());
    return whole_path_seconds_ * samples / pace_.threads() < kPilotShare * pace_.limit_left();
  }

  // Between sampled texels the denoiser alone tells errors.
  bool fills_between() const { return surface_ && !request_.sampled; }

  // Whole paths, from which the first cache is made: `count` for every site, or for those of that stride.
  Expected<PassEnd> pilot(uint32_t count, uint32_t stride, std::vector<SiteSamples>& work) {
    std::vector<SiteSamples> sites = all_sites({0, count});
    if (stride > 1) keep_stride(atlas_, stride, sites);
    KILN_TRY(const PassEnd end, run_pass(std::move(sites)));
    record(!is_limited());
    // The others have been given the errors of those around them.
    if (stride > 1) samples_.assign(samples_.size(), count);
    return end == PassEnd::kComplete ? make_caches(count, work, 0, stride) : end;
  }
  void drop(const std::vector<SiteSamples>& work) {
    std::vector<uint32_t> sites;
    for (const SiteSamples& s : work) sites.push_back(s.site), ++takes_[s.site];
    sums_.clear(sites);
  }
  void drop_all() {
    sums_.clear();
    for (uint32_t& take : takes_) ++take;
    grew_ = false;
    for (PassPoint& pass : report_.passes) pass.kept = false;
  }

  // There must be time to replace the dropped samples, at worst at the speed of whole paths.
  bool has_time_for_caches(uint32_t count, const std::vector<SiteSamples>& work) const {
    const double next = samples_of(work) + 2.0 * kReplicates * count * static_cast<double>(sums_.sites());
    return !(affordable_samples() < kSureToRenew * next);
  }

  // Makes a cache from `count` samples of every site, then runs a pass whose paths end at it, and again. The
  // first such pass lasts if another would follow but few sites err by the caches (those settle), and so does
  // one that a better cache did not help. `round`: 0 if the samples are of whole paths. `work`: what follows.
  Expected<PassEnd> make_caches(uint32_t count, std::vector<SiteSamples>& work, uint32_t round,
                                uint32_t stride = 1) {
    double before = std::numeric_limits<double>::infinity();  // error of one sample, as if independent
    for (;; ++round) {
      if (!has_time_for_caches(count, work)) return plan(work);
      renew_caches(round == 0 ? stride : 1);
      const double rms = reached_error(state(), ErrorNorm::kMeanSquare, 1), now = rms * std::sqrt(count);
      if (round > 1 && now > kSettled * before) return plan(work);
      before = now;
      const std::vector<double> needed = all_needed(asked_error());
      if (round > 0) count = std::min(2 * count, least_);  // of the next round
      const std::vector<uint32_t> none(needed.size());
      const SampleState dropped{errors_.mean, errors_.standard_error, none};
      bool enough = kReplicates * count * static_cast<double>(sums_.sites()) >
                    kRoundShare * missing_samples(needed, dropped, most_samples());
      if (round > 0) {
        enough |= rms <= kRoughCache || round == kMaxRounds;
        if (!enough && round == 1 && unsettled_share(settling_state()) < kMostUnsettled) return plan(work);
      }
      // What whole paths would still need says little about the time left if more rounds follow.
      if (round > 0 || enough) predict_remaining(needed, enough ? work : all_sites({0, count}), 0);
      drop_all();
      if (enough) return PassEnd::kComplete;
      KILN_TRY(const PassEnd end, run_pass(all_sites({0, count})));
      record();
      if (end != PassEnd::kComplete) return end;
    }
  }

  // Samples per replicate that every site needs for that error.
  std::vector<double> all_needed(double error) const {
    std::vector<double> needed = needed_samples(state(), norm_, error, z_, fall(), unmet_.get());
    for (const TexelErrors& e : response_errors_) {
      const std::vector<double> of_it =
          needed_samples({e.mean, e.standard_error, samples_}, norm_, settings_.visibility_error, z_);
      for (size_t i = 0; i < needed.size(); ++i) needed[i] = std::max(needed[i], of_it[i]);
    }
    // If time is short, every texel gets what is affordable first; later passes go where they are needed.
    const double least = is_limited() && !affords(least_) ? 1 : least_;
    for (double& n : needed) n = n > least ? n : least;  // NaN for constant light: no samples needed
    return needed;
  }
  // Whether `count` samples per replicate of every site fit into the time left.
  bool affords(uint32_t count) const {
    const std::vector<double> needed(samples_.size(), count);
    return missing_samples(needed, state(), count) < affordable_samples();
  }
  // Filters narrow as samples come, so denoised errors fall more slowly.
  double fall() const { return surface_ ? convergence_.get() : 1; }

  // Predicts the time to the end, with `work` as the next pass; reported with the last point and
  // during that pass. `kept`: share of the present samples that last.
  void predict_remaining(const std::vector<double>& needed, const std::vector<SiteSamples>& work,
                         double kept) {
    double samples = 0, growth = 1;
    for (size_t i = 0; i < needed.size(); ++i) {
      const double have = kept * samples_[i], to = std::min<double>(needed[i], most_samples());
      if (samples_[i] == 0 || skipped_.contains(static_cast<uint32_t>(i)) || !(to > have)) continue;
      samples += kReplicates * (to - have);
      growth = std::max(growth, to / samples_[i]);
    }
    pace_.end_barrier();
    later_passes_ = work.empty() ? 0 : std::ceil(std::log(growth) / std::log(kGrowth));
    foretell(samples_of(work), samples - samples_of(work));
  }
  // `now`, `later`: samples of the next pass, and of those after it.
  void foretell(double now, double later) {
    later_ = std::max(0.0, later);
    const double seconds = pace_.seconds_for(now + later_, later_passes_);
    if (seconds >= 0) report_.passes.back().seconds_left = seconds + budget_.seconds_after();
  }

  std::vector<SiteSamples> all_sites(SampleRange range) const {
    std::vector<SiteSamples> work;
    work.reserve(sums_.sites());
    for (uint32_t i = 0; i < sums_.sites(); ++i)
      if (is_sampled(i)) work.push_back({i, range});
    return work;
  }
  bool is_sampled(uint32_t site) const {
    return !request_.sampled || request_.sampled(atlas_.sites.texel[site], atlas_.width);
  }

  uint32_t most_samples() const { return most_; }  // per replicate
  // A bake limited only by time ignores the default --max-samples: the bound is raised once all
  // texels have reached it. (Not before: a nearly black texel would take all the time.)
  bool may_raise_most() const {
    constexpr uint32_t kUnbounded = 1u << 29;
    return is_limited() && !asks_for_error() && !settings_.source.count("max-samples") && most_ < kUnbounded;
  }
  bool is_limited() const { return std::isfinite(pace_.limit_left()); }
  // A time-limited bake uses all its time, unless an error was asked for too.
  double asked_error() const { return is_limited() && !asks_for_error() ? 0 : target_; }
  bool asks_for_error() const {
    return settings_.source.count(settings_.quantities.light ? "error" : "visibility-error") > 0;
  }

  // The error asked for, or what can be reached in the time left.
  double final_error() const {
    if (!is_limited()) return asked_error();
    return affordable_error(state(), norm_, asked_error(), z_, most_samples(), affordable_samples(), fall(),
                            unmet_.get());
  }

  // Decided between passes from merged sums only, so every run of the job decides alike (unless
  // time is limited).
  std::vector<SiteSamples> next_work(bool may_raise = true) {
    const double error = final_error();
    if (is_limited()) {
      report_.complete = reached_error(state(), norm_, z_, unmet_.get()) <= target_;
      for (const TexelErrors& e : response_errors_)
        report_.complete &=
            reached_error({e.mean, e.standard_error, samples_}, norm_, z_) <= settings_.visibility_error;
      if (pace_.limit_left() < kMinPassSeconds) {
        report_.passes.back().seconds_left = budget_.seconds_after();
        return {};
      }
    }
    const std::vector<double> needed = all_needed(error);
    // The norm may be reached before every texel has the share that was foretold for it.
    if (has_reached()) {
      predict_remaining({samples_.begin(), samples_.end()}, {}, 1);
      return {};
    }
    std::vector<SiteSamples> work = work_towards(needed, 1);
    // A few stragglers are cheap, but a pass for each of their steps is not.
    for (const double growth : {2.0, kGrowth})
      if (samples_of(work) < kStragglers * sampled_) work = work_towards(needed, growth);
    if (work.empty() && may_raise && may_raise_most()) {
      most_ *= 4;
      return next_work(false);
    }
    if (response_errors_.empty() && is_vain(work, state(), norm_, asked_error(), z_, unmet_.get()))
      work.clear();
    predict_remaining(needed, work, 1);
    return work;
  }

  // Whether the map as a whole has the error asked for.
  bool has_reached() const {
    if (norm_ != ErrorNorm::kMeanSquare || !response_errors_.empty()) return false;
    for (size_t site = 0; site < samples_.size(); ++site)
      if (samples_[site] > 0 && samples_[site] < least_) return false;
    return reached_error(state(), norm_, z_, unmet_.get()) <= asked_error();
  }

  // Whether every texel has all the samples that it may have.
  bool is_at_bound() const {
    if (samples_.empty() || may_raise_most()) return false;
    for (uint32_t site = 0; site < samples_.size(); ++site)
      if (samples_[site] < most_ && is_sampled(site) && !skipped_.contains(site)) return false;
    return true;
  }

  // Share of the sampled sites that have all the samples they may have, and too few for what is asked. A
  // bound that would be raised holds nothing back: time does.
  double held_back() const {
    if (has_reached() || errors_.mean.empty() || may_raise_most()) return 0;
    const std::vector<double> needed = all_needed(target_);
    size_t sites = 0, held = 0;
    for (size_t site = 0; site < samples_.size(); ++site) {
      sites += samples_[site] > 0;
      held += samples_[site] >= most_samples() && needed[site] > samples_[site];
    }
    return sites ? static_cast<double>(held) / static_cast<double>(sites) : 0;
  }

  std::vector<SiteSamples> work_towards(const std::vector<double>& needed, double least) const {
    std::vector<SiteSamples> work = kiln::work_towards(needed, samples_, most_samples(), least);
    skipped_.leave_out_of(work);
    return work;
  }

  SampleState state() const { return state_of(errors_, samples_, planned_); }

  // `stride`: of the sites that have samples.
  void renew_caches(uint32_t stride = 1) {
    sampled_at_renewal_ = sampled_;
    if (stride > 1)
      caches_.make_rough(sums_, pass_, stride);
    else
      caches_.renew(sums_, pass_);
  }

  Expected<PassEnd> run_pass(std::vector<SiteSamples> work) {
    // A pass that is repeated after a rewind is cut as before: its units are identified by number.
    const uint32_t index = pass_++;
    filters_.reset();
    const double samples = samples_of(work);
    sampled_ += samples;
    if (index == cuts_.size()) {
      uint32_t chosen = pace_.unit_texels(samples, settings_.tile_texels);
      if (request_.cut) {
        KILN_TRY(chosen, request_.cut(passes_before_ + index, chosen));
      }
      cuts_.push_back(chosen);
    }
    for (SiteSamples& s : work) s.take = takes_[s.site];
    std::vector<WorkUnit> units = cut_pass(work, cuts_[index], caches_.digests(), next_unit_);
    order_by_gain(errors_, units);
    active_ = work.size();
    const FarmStatistics earlier = farm_.statistics();
    pace_.set_limit(budget_.seconds_for_passes());
    pace_.begin_pass(samples, later_, later_passes_);
    PassHandlers handlers;
    handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) {
      nonfinite_.add(unit, result);
      return sums_.add(unit, result);
    };
    handlers.on_skipped = [&](const WorkUnit& unit, const std::string& why) { skipped_.add(unit, why); };
    handlers.on_progress = [&](const FarmProgress& f) { progress_(progress_of(f)); };
    KILN_TRY(const PassEnd end, farm_.run_pass(std::move(units), pace_.deadline_ms(), handlers));
    const FarmStatistics later = farm_.statistics();
    if (caches_.empty()) whole_path_seconds_ = (later.worker_seconds - earlier.worker_seconds) / samples;
    pace_.end_pass(cuts_[index], later.units - earlier.units, later.worker_seconds - earlier.worker_seconds);
    return end;
  }

  BakeProgress progress_of(const FarmProgress& f) {
    BakeProgress b;
    b.stage = "bake";
    b.pass = pass_;
    b.done = f.weight > 0 ? f.weight_done / f.weight : 0;
    b.rays = f.rays;
    b.rays_per_second = pace_.seconds() > 0 ? static_cast<double>(f.rays) / pace_.seconds() : 0;
    b.workers = f.workers;
    pace_.set_thread_count(f.threads);
    b.converged_share = report_.passes.empty() ? 0 : report_.passes.back().converged_share;
    b.seconds_left = pace_.seconds_left(b.done);
    if (b.seconds_left >= 0) b.seconds_left += budget_.seconds_after();
    return b;
  }

  // With little time, or few samples, passes are planned from unfiltered errors.
  bool should_filter(const TexelStatistics& statistics, uint32_t levels) const {
    if (!surface_) return false;
    if (!is_limited()) return true;
    return *std::min_element(statistics.samples.begin(), statistics.samples.end()) >= kFilterFrom &&
           budget_.denoise_seconds(levels) <= kFilterShare * pace_.limit_left();
  }

  // Updates the errors after a pass and adds a point to the curve. `dropped`: they are not filtered.
  void record(bool dropped = false) {
    response_errors_ = response_errors(sums_, charts_);
    if (!settings_.quantities.light) {
      errors_ = response_errors_.front();
      samples_ = sums_.replicate_samples();
      return add_point();
    }
    TexelStatistics statistics = sums_.statistics(false, !dropped);
    find_shared(charts_, statistics);
    const uint32_t levels = surface_ ? std::max(denoise_levels(statistics), budget_.denoise_levels()) : 0;
    budget_.denoise_will_be(levels);
    const bool filters = !dropped && should_filter(statistics, levels);
    TexelErrors errors;
    if (filters) {
      const Stopwatch watch;
      errors = filtered_errors(statistics, *surface_, levels, filters_);
      budget_.denoise_took(watch.seconds(), levels);
    } else {
      errors = estimate_errors(statistics, charts_);
      if (is_limited()) errors.mean = neighbourhood_means(statistics, charts_);
    }
    errors.measured = mean_luminances(statistics);
    const SampleState now = state_of(errors, statistics.samples);
    // A filter lights black texels too, without more samples.
    if (grew_ && filters == filtered_) {
      convergence_.observe(state(), now);
      unmet_.observe(state(), now);
    }
    grew_ = true;
    filtered_ = filters;
    errors_ = std::move(errors);
    samples_ = statistics.samples;
    shared_ = std::move(statistics.shared);
    if (norm_ == ErrorNorm::kMeanSquare) planned_ = planned_deviations(state(), charts_);
    add_point();
  }

  // After a round of settling: the errors stay those of before.
  void record_round() {
    TexelStatistics statistics = sums_.statistics(false);
    find_shared(charts_, statistics);
    samples_ = std::move(statistics.samples);
    shared_ = std::move(statistics.shared);
    add_point();
  }

  void add_point() {
    PassPoint point =
        state_pass(state(), response_errors_, {z_, target_, settings_.visibility_error}, unmet_.get());
    point.active = active_;
    point.seconds = pace_.seconds();
    point.rays = farm_.statistics().rays;
    report_.passes.push_back(point);
  }

  const BakeRequest& request_;
  const BakeSettings& settings_;
  FarmJob& farm_;
  Accumulator& sums_;
  BakeReport& report_;
  const std::function<void(const BakeProgress&)>& progress_;
  const SurfaceGraph* const surface_;
  const bool cache_;
  const Atlas& atlas_;
  NonfiniteLog nonfinite_;
  const std::vector<uint32_t> charts_;  // by site
  BakeCaches caches_;
  const double z_;
  const double target_;  // of errors_
  TimeBudget& budget_;
  ErrorNorm norm_ = ErrorNorm::kMax;
  BakePace pace_;
  uint32_t pass_ = 0;
  std::vector<uint32_t> takes_;    // by site: how often its samples were dropped
  uint32_t least_ = 0, most_ = 0;  // samples per replicate: every texel gets at least, and at most
  uint64_t active_ = 0;
  TexelErrors errors_;
  KeptFilters filters_;
  std::vector<TexelErrors> response_errors_;  // after the last pass
  std::vector<uint32_t> samples_;             // by site, per replicate
  std::vector<float> planned_;                // by site: SampleState::planned
  std::vector<float> shared_;                 // by site: TexelStatistics::shared; empty without caches
  ConvergenceRate convergence_;
  UnmetLight unmet_;
  bool filtered_ = false;                 // the present errors are those of filtered texels
  bool settled_ = false;                  // settle() has run
  bool grew_ = false;                     // the next record continues the present samples
  bool whole_ = true;                     // every chart has been sampled in the first look
  double later_ = -1, later_passes_ = 0;  // samples and passes after the present one; negative: unknown
  double whole_path_seconds_ = 0;         // of one thread, for a sample without caches
  double sampled_ = 0, sampled_at_renewal_ = 0;
  SkippedSites skipped_;
  std::vector<uint32_t> cuts_;  // texels per unit, by pass
  const uint32_t passes_before_;
  const uint64_t units_before_;
  uint64_t next_unit_;
};

}  // namespace

Expected<Baked> bake_passes(const BakingTask& task) {
  return Baking(task).run();
}

}  // namespace kiln
