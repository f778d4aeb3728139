// What one light of many costs and what it is worth: lamps and emissive panels in a building of 64 rooms,
// chosen by the light tree, by power and uniformly. Prints a Markdown table and draws a plot.
//   build/bin/many_lights [--svg FILE] [--most N]
#include <algorithm>
#include <cstdio>
#include <cstring>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "tests/analytic/scene_maker.h"
#include "tests/lights/statistics.h"
#include "worker/lights/lights.h"

namespace kiln {
namespace {

constexpr int kRooms = 8;  // a side
constexpr float kSize = 5, kHeight = 3, kDoor = 1;

// Rooms with a door in the middle of each wall; half of the lights are points, half panels under the ceiling.
Scene building(int lights) {
  test::SceneMaker m;
  const uint32_t wall = m.lambert(Vec3(0.7f), Vec3(0.0f), true);
  const float span = kRooms * kSize;
  m.quad({0, 0, 0}, {0, 0, span}, {span, 0, 0}, wall).quad({0, kHeight, 0}, {span, 0, 0}, {0, 0, span}, wall);
  const Vec3 up(0, kHeight, 0);
  for (int line = 0; line <= kRooms; ++line)
    for (int room = 0; room < kRooms; ++room) {
      const float at = static_cast<float>(line) * kSize, from = static_cast<float>(room) * kSize;
      const float piece = line == 0 || line == kRooms ? 0.5f * kSize : 0.5f * (kSize - kDoor);
      for (const float start : {from, from + kSize - piece}) {
        m.quad({at, 0, start}, up, {0, 0, piece}, wall);
        m.quad({start, 0, at}, up, {piece, 0, 0}, wall);
      }
    }
  test::Random random(1);
  for (int i = 0; i < lights; ++i) {
    const Vec3 at =
        random.in_box(Vec3(0.2f, 0.5f * kHeight, 0.2f), Vec3(span - 0.4f, kHeight - 0.05f, span - 0.4f));
    const float strength = std::pow(10.0f, 2 * random.one());  // two decades
    if (i % 2 == 0) {
      m.point(at, Vec3(strength));
    } else {
      const float side = 0.05f + 0.2f * random.one();
      m.quad(at, {side, 0, 0}, {0, 0, side}, m.lambert(Vec3(0.0f), Vec3(strength / (side * side))));
    }
  }
  return m.take();
}

struct Measured {
  double nanoseconds;  // a choice and a point on it
  double with_ray;     // and its shadow ray
  double deviation;    // of one sample, relative to the mean: root of the mean variance over receivers
};

struct Receiver {
  Vec3 p, n;
};

Ray to_light(const Receiver& r, const LightSample& s) {
  const Vec3 origin = r.p + r.n * 1e-4f;
  return {origin, r.p + s.segment - origin, 1.0f};
}

Measured measure(const Surfaces& surfaces, const Lights& lights, const Tracer& tracer,
                 const std::vector<Receiver>& receivers) {
  constexpr int kSamples = 4096, kRounds = 7;
  const LocalLights& local = lights.local;
  Measured out{};
  std::vector<double> times, ray_times;
  volatile float sink = 0;
  for (int round = 0; round < kRounds; ++round) {
    test::Random random(static_cast<uint64_t>(round));
    std::vector<Vec3> u;
    for (int i = 0; i < kSamples * 16; ++i) u.push_back(random.in_box(Vec3(0.0f), Vec3(1.0f)));
    for (const bool rays : {false, true}) {
      const Stopwatch watch;
      for (size_t i = 0; i < u.size(); ++i) {
        const Receiver& r = receivers[i % receivers.size()];
        const LightSample s = local.sample(surfaces, r.p, r.n, u[i].x, Vec2(u[i].y, u[i].z));
        sink = sink + s.weight.x;
        if (rays && s.weight.x > 0) sink = sink + tracer.transmittance(to_light(r, s)).x;
      }
      (rays ? ray_times : times).push_back(watch.seconds() / static_cast<double>(u.size()) * 1e9);
    }
  }
  for (std::vector<double>* t : {&times, &ray_times})
    std::nth_element(t->begin(), t->begin() + kRounds / 2, t->end());
  out.nanoseconds = times[kRounds / 2];
  out.with_ray = ray_times[kRounds / 2];
  double variance = 0, mean = 0;
  test::Random random(99);
  for (const Receiver& r : receivers) {
    test::Mean e;
    for (int i = 0; i < kSamples; ++i) {
      const float choice = random.one();
      const LightSample s = local.sample(surfaces, r.p, r.n, choice, random.two());
      const double cosine = dot(s.direction, r.n);
      double value = 0;
      if (s.weight.x > 0 && cosine > 0)
        value = cosine * static_cast<double>(s.weight.x * tracer.transmittance(to_light(r, s)).x);
      e.add(value);
    }
    variance += e.error() * e.error() * kSamples;
    mean += e.value();
  }
  const auto n = static_cast<double>(receivers.size());
  out.deviation = std::sqrt(variance / n) / (mean / n);
  return out;
}

struct Row {
  int lights;
  Measured by[3];  // tree, power, uniform
};
constexpr LightChoice kChoices[] = {LightChoice::kTree, LightChoice::kPower, LightChoice::kUniform};
constexpr const char* kNames[] = {"light tree", "power", "uniform"};
constexpr const char* kColors[] = {"#c0392b", "#2471a3", "#7f8c8d"};

// Both axes logarithmic.
std::string panel(const std::vector<Row>& rows, double left, const char* title, double low, double high,
                  double (*value)(const Measured&)) {
  constexpr double kTop = 50, kWidth = 330, kTall = 240;
  const double last = std::log10(static_cast<double>(rows.back().lights));
  const auto x = [&](double lights) { return left + kWidth * std::log10(lights) / std::max(1.0, last); };
  const auto y = [&](double v) {
    return kTop + kTall * (1 - std::log10(std::clamp(v, low, high) / low) / std::log10(high / low));
  };
  std::string out = text("<text x='{:.0f}' y='30' font-weight='bold'>{}</text>\n", left, title);
  for (double tick = low; tick <= high * 1.001; tick *= 10)
    out += text(
        "<line x1='{0:.1f}' x2='{1:.1f}' y1='{2:.1f}' y2='{2:.1f}' stroke='#ddd'/><text x='{3:.1f}' "
        "y='{4:.1f}' text-anchor='end'>{5:g}</text>\n",
        left, left + kWidth, y(tick), left - 6, y(tick) + 4, tick);
  for (const Row& row : rows)
    out += text("<text x='{:.1f}' y='{:.0f}' text-anchor='middle'>{}</text>\n", x(row.lights),
                kTop + kTall + 18, row.lights);
  out += text("<text x='{:.0f}' y='{:.0f}' text-anchor='middle'>lights</text>\n", left + kWidth / 2,
              kTop + kTall + 36);
  for (size_t k = 0; k < 3; ++k) {
    std::string points;
    for (const Row& row : rows) points += text("{:.1f},{:.1f} ", x(row.lights), y(value(row.by[k])));
    out += text("<polyline points='{}' fill='none' stroke='{}' stroke-width='2'/>\n", points, kColors[k]);
    const double key = kTop + 14 + 18 * static_cast<double>(k);
    out += text(
        "<line x1='{0:.0f}' x2='{1:.0f}' y1='{2:.0f}' y2='{2:.0f}' stroke='{3}' stroke-width='2'/><text "
        "x='{4:.0f}' y='{5:.0f}'>{6}</text>\n",
        left + 12, left + 36, key, kColors[k], left + 42, key + 4, kNames[k]);
  }
  return out;
}

double cost(const Measured& m) {
  return m.nanoseconds;
}
double error_of_64(const Measured& m) {
  return 100 * m.deviation / 8;
}
double error_of_100us(const Measured& m) {
  return 100 * m.deviation * std::sqrt(m.with_ray / 100e3);
}

Status bench(const std::string& svg, int most) {
  std::printf("| lights | triangles that shine | %s |\n",
              "ns a sample: tree, power, uniform | error of 64 samples | error of 100 us");
  std::printf("|---|---|---|---|---|\n");
  std::vector<Row> rows;
  for (int lights = 1; lights <= most; lights *= 10) {
    std::vector<std::string> warnings;
    KILN_TRY(const auto surfaces, Surfaces::create(building(lights), warnings));
    KILN_TRY(const auto tracer, Tracer::create(surfaces->scene(), *surfaces, "avx2", 2));
    // In as many rooms as there are lights: where there is none, nothing can be measured.
    std::vector<Receiver> receivers;
    test::Random random(2);
    const auto& instances = surfaces->scene().instances;
    for (int i = 0; i < 256; ++i) {
      const float span = kRooms * kSize;
      Vec3 p = random.in_box(Vec3(0.05f, 0, 0.05f), Vec3(span - 0.05f, 0, span - 0.05f));
      if (lights < 100) {  // near one of them
        const size_t k = static_cast<size_t>(random.one() * static_cast<float>(lights));
        Vec3 at(0.0f);
        if (k % 2 == 0)
          at = surfaces->scene().lights[k / 2].to_world[3];
        else
          at = surfaces->scene()
                   .meshes[instances[instances.size() - static_cast<size_t>(lights / 2) + k / 2].mesh]
                   .positions[0];
        p = random.in_box(at - Vec3(1), at + Vec3(1));
      }
      p.y = 0;
      receivers.push_back({p, Vec3(0, 1, 0)});
    }
    Row row{lights, {}};
    for (size_t k = 0; k < 3; ++k) {
      KILN_TRY(const Lights all, Lights::create(*surfaces, warnings, kChoices[k]));
      row.by[k] = measure(*surfaces, all, *tracer, receivers);
    }
    const auto three = [&](double (*value)(const Measured&), const char* unit) {
      return text("{:.3g}, {:.3g}, {:.3g}{}", value(row.by[0]), value(row.by[1]), value(row.by[2]), unit);
    };
    std::printf("| %d | %d | %s | %s | %s |\n", lights, 2 * (lights / 2), three(cost, "").c_str(),
                three(error_of_64, " %").c_str(), three(error_of_100us, " %").c_str());
    std::fflush(stdout);
    rows.push_back(row);
  }
  if (svg.empty()) return {};
  std::string out =
      "<svg xmlns='http://www.w3.org/2000/svg' width='1240' height='345' font-family='sans-serif' "
      "font-size='12'>\n"
      "<rect width='1240' height='345' fill='white'/>\n";
  out += panel(rows, 60, "nanoseconds a light sample", 1, 10000, cost);
  out += panel(rows, 470, "error of 64 samples, %", 1, 10000, error_of_64);
  out += panel(rows, 880, "error of 100 microseconds with shadow rays, %", 1, 10000, error_of_100us);
  return write_file_atomic(svg, out + "</svg>\n");
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  std::string svg;
  int most = 100000;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--svg") == 0) svg = argv[i + 1];
    if (std::strcmp(argv[i], "--most") == 0) most = std::atoi(argv[i + 1]);
  }
  if (kiln::Status s = kiln::bench(svg, most); !s) {
    std::fprintf(stderr, "%s\n", s.error().message.c_str());
    return 1;
  }
  return 0;
}
