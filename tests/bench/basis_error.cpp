// How wrong is what an engine evaluates from a basis, at the surface's own normal and at turned ones?
//
//     basis_error SCENE [texels=1500] [samples=512] [bases=sh_l1,ad9,...] [NAME=VALUE ...]
//
// Bakes texels of SCENE (evenly chosen) without cache or filter in every fit of every basis, or of those, and
// the same texels with their normals turned by 15, 30, 35, 50 and 60 degrees in four ways: their E is the
// truth. Halves of the samples are multiplied, so that the noise of neither side counts: (shown_1 -
// true_1)(shown_2
// - true_2), one from each replicate, where the halves share no random numbers. NAME=VALUE: settings of the
// layout and the light. Prints a row per fit for docs/bases.md: at the own normal the mean and the 99th
// percentile of |shown / E - 1| for the texel's mean normal; then rms over turned normals relative to the
// mean of E there.
#include <cstdio>

#include "common/atlas/texel_normals.h"
#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "common/responses/sh_l1_fit.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/run/workplace.h"
#include "worker/bake/path_baker.h"

namespace kiln {
namespace {

constexpr int kWays = 4;
constexpr double kAngles[] = {15, 30, 35, 50, 60};

// About the surface's normal, which is the z axis.
Vec3 turned(double degrees, int way) {
  const double a = degrees * M_PI / 180, phi = way * M_PI / 2;
  return Vec3(std::sin(a) * std::cos(phi), std::sin(a) * std::sin(phi), std::cos(a));
}

// The rotation along the shortest arc from the z axis to `to`, of v.
Vec3 rotated(const Vec3& v, const Vec3& to) {
  const Vec3 across(to.x, to.y, 0), axis = normalize_or(cross(Vec3(0, 0, 1), across), Vec3(1, 0, 0));
  const float sine = length(across);
  return v * to.z + cross(axis, v) * sine + axis * (dot(axis, v) * (1 - to.z));
}

// Texels whose normals are turned: as if the surface of a whole texel were, so that places of other normals
// within it keep their angles to the mean normal, `normals` by site.
class TurnedReceivers {
 public:
  TurnedReceivers(Atlas atlas, std::vector<Vec3> normals, const Vec3& turn)
      : texels_(std::move(atlas)), normals_(std::move(normals)), turn_(turn) {}
  size_t size() const { return texels_.size(); }
  uint32_t key(uint32_t index) const { return texels_.key(index); }

  class Open {
   public:
    Open(const TurnedReceivers& r, const Surfaces& surfaces, const Tracer& tracer, uint32_t index)
        : open_(r.texels_, surfaces, tracer, index), frame_(r.normals_[index]), turn_(r.turn_) {}
    SurfacePoint at(const SampleStream& stream) { return turn(open_.at(stream)); }
    std::optional<SitePlaces::Place> instead_of(const SampleStream& stream, uint64_t& rays) {
      auto place = open_.instead_of(stream, rays);
      if (place) place->point = turn(place->point);
      return place;
    }

   private:
    SurfacePoint turn(SurfacePoint p) const {
      p.ns = frame_.to_world(rotated(frame_.to_local(p.ns), turn_));
      return p;
    }
    TexelReceivers::Open open_;
    Frame frame_;
    Vec3 turn_;
  };
  using Sums = Film;
  std::optional<KnownIrradiance> known(const Scene&, const IrradianceCache&) const { return std::nullopt; }

 private:
  TexelReceivers texels_;
  std::vector<Vec3> normals_;
  Vec3 turn_;
};

// Means of both replicates, of the planes E and those of the basis, by chosen site.
struct Means {
  size_t planes = 0;
  std::vector<double> values[kReplicates];
  Vec3 e(int replicate, size_t i) const { return colour(replicate, i, 0); }
  Vec3 colour(int replicate, size_t i, size_t first) const {
    const double* v = &values[replicate][i * planes + first];
    return Vec3(float(v[0]), float(v[1]), float(v[2]));
  }
};

struct Lab {
  Preflight pre;
  TransportSettings transport;
  std::vector<uint32_t> sites;
  uint32_t samples;
};

template <class Receivers>
Means bake(const Lab& lab, Receivers receivers, uint32_t basis) {
  TransportSettings settings = lab.transport;
  settings.basis = basis;
  PathBaker<Receivers> baker(std::move(receivers), settings);
  if (const Status s = baker.build(lab.pre.imported.scene, 2); !s)
    throw std::runtime_error(s.error().message);
  const MomentLayout layout(basis);
  Means means;
  means.planes = 3 + 3 * layout.functions();
  constexpr size_t kRun = 32;
  for (uint32_t r = 0; r < kReplicates; ++r) {
    means.values[r].resize(lab.sites.size() * means.planes);
    parallel_for((lab.sites.size() + kRun - 1) / kRun, [&](size_t run) {
      WorkUnit unit{run, 0, lab.samples / kReplicates};
      unit.replicate = r;
      const size_t begin = run * kRun, end = std::min(lab.sites.size(), begin + kRun);
      unit.sites.assign(lab.sites.begin() + begin, lab.sites.begin() + end);
      const auto result = baker.bake(unit, nullptr);
      if (!result) throw std::runtime_error(result.error().message);
      for (size_t i = begin; i < end; ++i) {
        const double* sums = &result->moments[(i - begin) * layout.planes()];
        double* out = &means.values[r][i * means.planes];
        for (size_t c = 0; c < 3; ++c) out[c] = sums[kMomentER + c] / unit.sample_count;
        for (size_t p = 3; p < means.planes; ++p) out[p] = sums[kMomentBasis + p - 3] / unit.sample_count;
      }
    });
  }
  return means;
}

// What a basis stores, finished, of a site and a replicate (or the mean of both: -1).
struct Stored {
  float f[3][kMaxBasisFunctions];
};
Stored stored_of(const BasisInfo& basis, const Means& means, int replicate, size_t i, const Vec3& n) {
  Stored out{};
  for (int c = 0; c < 3; ++c) {
    const auto value = [&](size_t plane) {
      const size_t at = i * means.planes + plane;
      return static_cast<float>(replicate < 0 ? (means.values[0][at] + means.values[1][at]) / 2
                                              : means.values[replicate][at]);
    };
    for (size_t k = 0; k < basis.functions.size(); ++k) out.f[c][k] = value(3 + 3 * k + c);
    if (basis.finish) basis.finish(value(c), n, out.f[c]);
  }
  return out;
}

// At normal m of a surface of normal n.
using Evaluate = float (*)(const float*, const Vec3& n, const Vec3& m);
Vec3 shown(const Stored& s, Evaluate evaluate, const Vec3& n, const Vec3& m) {
  return {evaluate(s.f[0], n, m), evaluate(s.f[1], n, m), evaluate(s.f[2], n, m)};
}

struct Form {
  std::string name;
  uint32_t basis;
  Evaluate evaluate;
};

// Every fit of the bases named, or of all; the projection on L1 by both evaluators.
std::vector<Form> forms_of(const std::string& bases) {
  std::vector<Form> forms;
  const std::string wanted = "," + bases + ",";
  for (uint32_t index = 0; index < basis_roster().size(); ++index) {
    const BasisInfo& b = basis_roster()[index];
    const std::string name(b.name), fit(b.fit), evaluator(b.evaluator);
    if (b.functions.empty() || (!bases.empty() && wanted.find("," + name + ",") == std::string::npos))
      continue;
    const bool is_l1 = name == "sh_l1";
    forms.push_back({name + ", " + fit + (is_l1 ? ", " + evaluator : ""), index, b.irradiance});
    if (is_l1 && fit == "project")
      forms.push_back({"sh_l1, project, hazel", index, ShL1Hazel::info().irradiance});
  }
  return forms;
}

void print_row(const Lab& lab, const Form& form, const Means& means, const std::vector<Means>& truth,
               const std::vector<Vec3>& normals) {
  const BasisInfo& basis = basis_roster()[form.basis];
  const size_t count = lab.sites.size();
  std::vector<double> off;
  double mean = 0, signed_sum = 0;
  for (size_t i = 0; i < count; ++i) mean += luminance((means.e(0, i) + means.e(1, i)) * 0.5f);
  if (!(mean > 0)) throw std::runtime_error("no texel receives light: give the scene's sun and environment");
  mean /= static_cast<double>(count);
  for (size_t i = 0; i < count; ++i) {
    const double e = luminance((means.e(0, i) + means.e(1, i)) * 0.5f);
    if (!(e > 0.01 * mean)) continue;  // as in the relMSE of kiln compare
    const double s =
        luminance(shown(stored_of(basis, means, -1, i, normals[i]), form.evaluate, normals[i], normals[i]));
    off.push_back(std::abs(s / e - 1));
    signed_sum += s / e - 1;
  }
  std::sort(off.begin(), off.end());
  std::printf("| %s | %zu | %+.3f %% | %.3f %% |", form.name.c_str(), basis.functions.size(),
              100 * signed_sum / static_cast<double>(off.size()), 100 * off[off.size() * 99 / 100]);
  for (size_t a = 0; a < std::size(kAngles); ++a) {
    double squares = 0, all = 0, bias = 0;
    for (int way = 0; way < kWays; ++way)
      for (size_t i = 0; i < count; ++i) {
        const Means& t = truth[a * kWays + way];
        const Vec3 n = Frame(normals[i]).to_world(turned(kAngles[a], way));
        double d[kReplicates];
        for (int r = 0; r < int{kReplicates}; ++r) {
          const double s =
              luminance(shown(stored_of(basis, means, r, i, normals[i]), form.evaluate, normals[i], n));
          d[r] = s - luminance(t.e(r, i));
          all += luminance(t.e(r, i)) / kReplicates;
          bias += d[r] / kReplicates;
        }
        squares += d[0] * d[1];
      }
    const double n = static_cast<double>(kWays * count);
    std::printf(" %.1f (%+.1f) |", 100 * std::sqrt(std::max(0.0, squares / n)) / (all / n), 100 * bias / all);
  }
  std::printf("\n");
}

int run(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: basis_error SCENE [texels=N] [samples=N] [NAME=VALUE ...]\n", stderr);
    return 2;
  }
  Lab lab;
  BakeSettings settings;
  size_t texels = 1500;
  std::string bases;
  lab.samples = 512;
  for (int i = 2; i < argc; ++i) {
    const std::string entry = argv[i];
    const size_t equals = entry.find('=');
    const std::string name = entry.substr(0, equals), value = entry.substr(equals + 1);
    if (name == "texels")
      texels = std::stoul(value);
    else if (name == "bases")
      bases = value;
    else if (name == "samples")
      lab.samples = static_cast<uint32_t>(std::stoul(value));
    else if (const Status s = set_option(settings, name, value, "command line"); !s)
      throw std::runtime_error(s.error().message);
  }
  std::vector<StageTime> times;
  auto pre = run_preflight(argv[1], settings, times, [](const BakeProgress&) {});
  if (!pre) throw std::runtime_error(pre.error().message);
  lab.pre = std::move(*pre);
  ChunkStore chunks;
  const auto job = make_job(lab.pre, settings, chunks);
  if (!job) throw std::runtime_error(job.error().message);
  lab.transport = job->transport;
  const size_t all = lab.pre.atlas.sites.size();
  for (size_t i = 0; i < std::min(texels, all); ++i)
    lab.sites.push_back(static_cast<uint32_t>((2 * i + 1) * all / (2 * std::min(texels, all))));

  const std::vector<Form> forms = forms_of(bases);
  std::vector<Means> baked;
  for (const Form& form : forms) baked.push_back(bake(lab, TexelReceivers(lab.pre.atlas), form.basis));
  const std::vector<Vec3> by_texel = texel_normals(lab.pre.imported.scene, lab.pre.atlas);
  std::vector<Vec3> by_site, normals;
  for (const uint32_t texel : lab.pre.atlas.sites.texel)
    by_site.push_back(by_texel[texel] == Vec3(0.0f) ? Vec3(0, 0, 1) : by_texel[texel]);
  for (const uint32_t site : lab.sites) normals.push_back(by_site[site]);
  std::vector<Means> truth;
  lab.transport.seed += 1000003;  // other random numbers than the bakes that are judged
  for (const double angle : kAngles)
    for (int way = 0; way < kWays; ++way)
      truth.push_back(bake(lab, TurnedReceivers(lab.pre.atlas, by_site, turned(angle, way)), 0));
  std::printf("%zu of %zu texels, %u samples\n", lab.sites.size(), all, lab.samples);
  std::printf(
      "| basis, fit | numbers | mean at n | p99 at n | 15 deg | 30 | 35 | 50 | 60 "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  for (size_t k = 0; k < forms.size(); ++k) print_row(lab, forms[k], baked[k], truth, normals);
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  try {
    return kiln::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
