#include "coordinator/scene/import/ies_profile.h"

#include <charconv>
#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr double kMaxAngles = 4096;
constexpr size_t kMaxTilts = 4096;

tl::unexpected<Error> bad(std::string what) {
  return fail(ErrorKind::kInvalidInput, std::move(what));
}

class Reader {
 public:
  explicit Reader(std::string_view text) : rest_(text) {}

  // Strips the line ending of any system.
  std::string_view line() {
    const size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    const std::string_view out = rest_.substr(0, end);
    const bool pair = rest_.substr(end, 2) == "\r\n";
    rest_.remove_prefix(std::min(rest_.size(), end + (pair ? 2 : 1)));
    return out;
  }
  bool at_end() const { return rest_.empty(); }

  // Numbers are separated by blanks, line ends or commas, wherever lines break.
  Expected<double> number(const char* what, size_t index = 0) {
    const size_t begin = rest_.find_first_not_of(" \t\r\n,\x1a");
    if (begin == std::string_view::npos) return bad(text("it ends where {} {} should be", what, index));
    rest_.remove_prefix(begin);
    std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n,\x1a"));
    rest_.remove_prefix(word.size());
    const std::string_view digits = word.substr(word.front() == '+' ? 1 : 0);
    double value = 0;
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (code != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
      return bad(text("{} {} is '{}', which is not a number", what, index, word.substr(0, 40)));
    return value;
  }
  Status numbers(const char* what, size_t count, std::vector<double>& out) {
    for (size_t i = 0; i < count; ++i) {
      KILN_TRY(const double value, number(what, i));
      out.push_back(value);  // grows with the file, not with what it claims
    }
    return {};
  }

 private:
  std::string_view rest_;
};

Expected<size_t> count_of(double value, const char* what) {
  if (!(value >= 1 && value <= kMaxAngles) || value != std::floor(value))
    return bad(text("{} {} are not between 1 and {}", value, what, kMaxAngles));
  return static_cast<size_t>(value);
}

Status check_rising(const std::vector<double>& angles, const char* what) {
  for (size_t i = 1; i < angles.size(); ++i)
    if (!(angles[i] > angles[i - 1]))
      return bad(text("{} angle {} is {} after {}: they must rise", what, i, angles[i], angles[i - 1]));
  return {};
}

// The headers and keywords before TILT=; `version` is the year that the first line names, 1986 without one.
Expected<std::string_view> find_tilt(Reader& r, int& version) {
  version = 1986;
  bool first = true;
  while (!r.at_end()) {
    std::string_view line = r.line();
    if (first)
      for (const auto& [mark, year] : {std::pair{"63-2019", 2019},
                                       {"63-2002", 2002},
                                       {"63-1995", 1995},
                                       {"63-95", 1995},
                                       {"IESNA91", 1991},
                                       {"63-1991", 1991}})
        if (line.find(mark) != std::string_view::npos) version = year;
    first = false;
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
    if (line.substr(0, 5) != "TILT=") continue;
    line.remove_prefix(5);
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
    return line;
  }
  return bad("it has no line TILT=: this is not an IES profile");
}

// Lamp-to-luminaire geometry, then a count of angles and factors.
Status skip_tilt(Reader& r) {
  KILN_TRY_STATUS(r.number("the lamp's position"));
  KILN_TRY(const double pairs, r.number("the number of tilt angles"));
  if (!(pairs >= 0 && pairs <= static_cast<double>(kMaxTilts)) || pairs != std::floor(pairs))
    return bad(text("{} tilt angles are not between 0 and {}", pairs, kMaxTilts));
  std::vector<double> skipped;
  return r.numbers("tilt value", 2 * static_cast<size_t>(pairs), skipped);
}

// Adds the planes omitted by symmetry (LM-63, horizontal angles of type C).
Status unfold(IesProfile& p) {
  const std::vector<double> planes = p.horizontal;
  const std::vector<double> values = p.candela;
  const size_t n = p.vertical.size();
  if (planes.size() == 1) {
    p.horizontal = {0};
    return {};
  }
  const double first = planes.front(), last = planes.back();
  std::vector<std::pair<double, size_t>> all;  // angle, plane of the file
  for (size_t i = 0; i < planes.size(); ++i) all.emplace_back(planes[i], i);
  const auto mirror = [&](double sum) {  // plane at sum - angle
    for (size_t i = all.size(); i-- > 0;)
      if (sum - all[i].first > all.back().first) all.emplace_back(sum - all[i].first, all[i].second);
  };
  if (first == 0 && last == 90) {
    mirror(180);
    mirror(360);
  } else if (first == 0 && last == 180) {
    mirror(360);
  } else if (first == 90 && last == 270) {
    // Symmetric about the plane from 90 to 270: 180 - angle, wrapped into [0, 360].
    std::vector<std::pair<double, size_t>> turned;
    for (size_t i = planes.size(); i-- > 0;)
      if (planes[i] <= 180) turned.emplace_back(180 - planes[i], i);
    for (size_t i = 0; i < planes.size(); ++i)
      if (planes[i] > 90) turned.emplace_back(planes[i], i);
    for (size_t i = planes.size() - 1; i-- > 0;)
      if (planes[i] >= 180) turned.emplace_back(540 - planes[i], i);
    all = turned;
    if (all.front().first != 0 || all.back().first != 360)
      return bad("horizontal angles from 90 to 270 without one at 180 leave a gap");
  } else if (first == 0 && last > 180 && last < 360) {
    all.emplace_back(360.0, 0);  // the last plane, which some files omit, equals the first
  } else if (!(first == 0 && last == 360)) {
    return bad(
        text("horizontal angles from {} to {} are not a symmetry of type C (0 to 0, 90, 180 or 360, or 90 "
             "to 270)",
             first, last));
  }
  p.horizontal.clear();
  p.candela.clear();
  for (const auto& [angle, plane] : all) {
    p.horizontal.push_back(angle);
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(plane * n);
    p.candela.insert(p.candela.end(), from, from + static_cast<std::ptrdiff_t>(n));
  }
  return {};
}

}  // namespace

Expected<IesProfile> parse_ies(std::string_view file) {
  if (file.substr(0, 3) == "\xEF\xBB\xBF") file.remove_prefix(3);
  Reader r(file);
  int version = 0;
  KILN_TRY(const std::string_view tilt, find_tilt(r, version));
  IesProfile p;
  p.tilted = tilt != "NONE";
  if (tilt == "INCLUDE") KILN_TRY_STATUS(skip_tilt(r));
  // Lamps, lumens, multiplier, vertical angles, horizontal angles, type, units, width, length, height; then
  // ballast factor, a second factor (until 1995; later versions use it otherwise), watts.
  std::vector<double> h;
  KILN_TRY_STATUS(r.numbers("header value", 13, h));
  KILN_TRY(const size_t vertical, count_of(h[3], "vertical angles"));
  KILN_TRY(const size_t horizontal, count_of(h[4], "horizontal angles"));
  if (h[5] != 1)
    return bad(text("its photometry is of type {}; type C (1) is read, have it converted",
                    h[5] == 2   ? "B (2)"
                    : h[5] == 3 ? "A (3)"
                                : text("{}", h[5])));
  const double factor = h[2] * h[10] * (version <= 1995 ? h[11] : 1.0);
  if (!(factor >= 0)) return bad(text("its factors {}, {} and {} are not a valid scale", h[2], h[10], h[11]));
  KILN_TRY_STATUS(r.numbers("vertical angle", vertical, p.vertical));
  KILN_TRY_STATUS(r.numbers("horizontal angle", horizontal, p.horizontal));
  KILN_TRY_STATUS(check_rising(p.vertical, "vertical"));
  KILN_TRY_STATUS(check_rising(p.horizontal, "horizontal"));
  if (p.vertical.size() < 2 || p.vertical.front() < 0 || p.vertical.back() > 180)
    return bad(text("vertical angles from {} to {} are not at least two within 0 and 180", p.vertical.front(),
                    p.vertical.back()));
  KILN_TRY_STATUS(r.numbers("candela value", vertical * horizontal, p.candela));
  for (size_t i = 0; i < p.candela.size(); ++i) {
    double& value = p.candela[i];
    value *= factor;
    if (!(value >= 0) || !std::isfinite(static_cast<float>(value)))
      return bad(text("candela value {} is {}", i, value));
  }
  KILN_TRY_STATUS(unfold(p));
  return p;
}

}  // namespace kiln
