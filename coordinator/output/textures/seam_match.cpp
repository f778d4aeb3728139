#include "coordinator/output/textures/seam_match.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"
#include "common/math/vec.h"

namespace kiln {
namespace {

// A step along one texel of seam counts as much as this many texels with that error.
constexpr double kSeamShare = 4;
constexpr float kSeamWeight = 4;      // of seam texels while a block is encoded anew
constexpr int kRounds[] = {1, 2, 3};  // by effort
// Steps below this share of the light (or of a ratio's range) are invisible: their blocks are kept.
constexpr double kEnough = 0.005;

struct Block {
  size_t first_texel = 0;  // its upper left one, pages stacked
  uint32_t page = 0, index = 0;
  uint32_t columns = 4, rows = 4;   // within the page
  std::vector<uint32_t> equations;  // equations that read it
};

class Matcher {
 public:
  Matcher(const SeamBlocks& in, std::span<const SeamEquation> equations) : in_(in), equations_(equations) {
    for (const SeamEquation& e : equations_) {
      norm_.push_back(norm_of(e));
      wanted_.push_back(step(e, in_.target));
    }
    excess_.resize(equations_.size());
    parallel_for(equations_.size(), [&](size_t i) { excess_[i] = excess(i); });
    find_blocks();
  }

  SeamMatch run() {
    SeamMatch out;
    out.equations = equations_.size();
    out.blocks = blocks_.size();
    measure(out.rms_before, out.largest_before);
    for (int round = 0; round < kRounds[static_cast<int>(in_.choice.effort)]; ++round) {
      const uint64_t changed = improve();
      out.changed += changed;
      if (changed == 0) break;
    }
    measure(out.rms_after, out.largest_after);
    return out;
  }

 private:
  DVec3 value(std::span<const float> image, size_t t) const {
    return {image[4 * t], image[4 * t + 1], image[4 * t + 2]};
  }
  DVec3 step(const SeamEquation& e, std::span<const float> image) const {
    DVec3 sum(0.0);
    for (int s = 0; s < 2; ++s)
      for (uint32_t k = 0; k < e.side[s].count; ++k)
        sum += (s ? -1.0 : 1.0) * double{e.side[s].weight[k]} * value(image, e.side[s].texel[k]);
    return sum;
  }
  // The step added by compression, stored in excess_.
  DVec3 excess(size_t i) const { return step(equations_[i], *in_.decoded) - wanted_[i]; }

  // Weight by the mean light that the equation reads: the mean over its texels of the squared reference of
  // relative differences.
  double norm_of(const SeamEquation& e) const {
    double light = 0;
    for (const Lookup& side : e.side)
      for (uint32_t k = 0; k < side.count; ++k)
        if (const double norm = in_.norm[side.texel[k]]; norm > 0)
          light += 0.5 * double{side.weight[k]} / std::sqrt(norm);
    return light > 0 ? 1 / (light * light) : 0;
  }
  double squared_step(uint32_t i) const { return norm_[i] * dot(excess_[i], excess_[i]) / 3; }

  void find_blocks() {
    const uint32_t across = (in_.width + 3) / 4, down = (in_.page_height + 3) / 4;
    const auto block_of = [&](size_t t) {
      const size_t x = t % in_.width, row = t / in_.width;
      return (row / in_.page_height * down + row % in_.page_height / 4) * across + x / 4;
    };
    readers_.resize(equations_.size());
    std::vector<std::pair<size_t, uint32_t>> uses;
    for (uint32_t i = 0; i < equations_.size(); ++i)
      for (const Lookup& side : equations_[i].side)
        for (uint32_t k = 0; k < side.count; ++k) uses.emplace_back(block_of(side.texel[k]), i);
    std::sort(uses.begin(), uses.end());
    uses.erase(std::unique(uses.begin(), uses.end()), uses.end());
    for (size_t i = 0; i < uses.size();) {
      Block b;
      const size_t number = uses[i].first, bx = number % across, by = number / across % down;
      b.page = static_cast<uint32_t>(number / across / down);
      b.index = static_cast<uint32_t>(number % (size_t{across} * down));
      b.first_texel = (b.page * size_t{in_.page_height} + 4 * by) * in_.width + 4 * bx;
      b.columns = std::min<uint32_t>(4, in_.width - static_cast<uint32_t>(4 * bx));
      b.rows = std::min<uint32_t>(4, in_.page_height - static_cast<uint32_t>(4 * by));
      for (; i < uses.size() && uses[i].first == number; ++i) b.equations.push_back(uses[i].second);
      for (const uint32_t e : b.equations) readers_[e].push_back(static_cast<uint32_t>(blocks_.size()));
      blocks_.push_back(std::move(b));
    }
    open_.assign(blocks_.size(), 1);
  }

  template <class Visit>
  void for_each_texel(const Block& b, const Visit& visit) const {
    for (uint32_t y = 0; y < b.rows; ++y)
      for (uint32_t x = 0; x < b.columns; ++x) visit(4 * y + x, b.first_texel + size_t{y} * in_.width + x);
  }

  double energy(const Block& b) const {
    double sum = 0;
    for (const uint32_t i : b.equations)
      sum += kSeamShare * equations_[i].texels * norm_[i] * dot(excess_[i], excess_[i]);
    for_each_texel(b, [&](uint32_t, size_t t) {
      const DVec3 d = value(*in_.decoded, t) - value(in_.target, t);
      sum += double{in_.norm[t]} * dot(d, d);
    });
    return sum;
  }

  void measure(double& rms, double& largest) const {
    for (uint32_t i = 0; i < equations_.size(); ++i) {
      const double relative = std::sqrt(squared_step(i));
      rms += relative * relative;
      largest = std::max(largest, relative);
    }
    if (!equations_.empty()) rms = std::sqrt(rms / static_cast<double>(equations_.size()));
  }

  // The smallest change of each equation's texels that closes half of its step from either side, averaged
  // where equations share a texel.
  std::vector<DVec3> corrections(std::vector<float>& sums) const {
    std::vector<DVec3> out(sums.size(), DVec3(0.0));
    for (size_t i = 0; i < equations_.size(); ++i) {
      const SeamEquation& e = equations_[i];
      const DVec3 d = excess_[i];
      for (int s = 0; s < 2; ++s) {
        double square = 0;
        for (uint32_t k = 0; k < e.side[s].count; ++k)
          square += double{e.side[s].weight[k]} * e.side[s].weight[k];
        for (uint32_t k = 0; square > 0 && k < e.side[s].count; ++k) {
          const double w = e.side[s].weight[k];
          out[e.side[s].texel[k]] += d * ((s ? 0.5 : -0.5) * w / square * (w * e.texels));
          sums[e.side[s].texel[k]] += static_cast<float>(w * e.texels);
        }
      }
    }
    for (size_t t = 0; t < out.size(); ++t)
      if (sums[t] > 0) out[t] /= double{sums[t]};
    return out;
  }

  uint64_t improve() {
    std::vector<float> touched(in_.weight.size(), 0);
    const std::vector<DVec3> correction = corrections(touched);
    const uint32_t bytes = in_.format->bytes;
    std::vector<uint8_t> candidates(blocks_.size() * bytes);
    std::vector<uint8_t> tried(blocks_.size(), 0);
    parallel_for(blocks_.size(), [&](size_t i) {
      if (!open_[i] || !shows_a_step(blocks_[i])) return;
      tried[i] = 1;
      BlockTexels t{};
      for_each_texel(blocks_[i], [&](uint32_t k, size_t texel) {
        t.weight[k] = in_.weight[texel];
        const bool seam = touched[texel] > 0;
        if (seam) t.weight[k] *= kSeamWeight;
        for (int c = 0; c < 4; ++c) {
          float v = in_.target[4 * texel + c];
          if (seam && c < 3) v = (*in_.decoded)[4 * texel + c] + static_cast<float>(correction[texel][c]);
          t.rgba[k][c] = std::clamp(std::isfinite(v) ? v : 0.0f, in_.format->lowest, in_.format->highest);
        }
      });
      fill_block(t);
      in_.format->encode(t, in_.choice, &candidates[i * bytes]);
    });
    // A block that did not improve will not until a neighbour changes.
    std::fill(open_.begin(), open_.end(), 0);
    uint64_t changed = 0;
    for (size_t i = 0; i < blocks_.size(); ++i) {
      if (!tried[i] || !keep_if_better(blocks_[i], &candidates[i * bytes])) continue;
      ++changed;
      for (const uint32_t e : blocks_[i].equations)
        for (const uint32_t other : readers_[e]) open_[other] = 1;
    }
    return changed;
  }

  bool shows_a_step(const Block& b) const {
    return std::any_of(b.equations.begin(), b.equations.end(),
                       [&](uint32_t e) { return squared_step(e) > kEnough * kEnough; });
  }

  bool keep_if_better(const Block& b, const uint8_t* candidate) {
    uint8_t* stored = reinterpret_cast<uint8_t*>(&(*in_.pages)[b.page][size_t{b.index} * in_.format->bytes]);
    if (std::equal(candidate, candidate + in_.format->bytes, stored)) return false;
    BlockTexels t{};
    in_.format->decode(candidate, t);
    const double before = energy(b);
    const auto exchange = [&] {
      for_each_texel(b, [&](uint32_t k, size_t texel) {
        for (int c = 0; c < 4; ++c) std::swap(t.rgba[k][c], (*in_.decoded)[4 * texel + c]);
      });
      for (const uint32_t i : b.equations) excess_[i] = excess(i);
    };
    exchange();
    if (!(energy(b) < before)) {
      exchange();
      return false;
    }
    std::copy_n(candidate, in_.format->bytes, stored);
    return true;
  }

  const SeamBlocks& in_;
  std::span<const SeamEquation> equations_;
  std::vector<double> norm_;
  std::vector<DVec3> wanted_,
      excess_;  // by equation: the target's step, and the excess of the decoded one
  std::vector<Block> blocks_;
  std::vector<std::vector<uint32_t>> readers_;  // blocks by equation
  std::vector<uint8_t> open_;                   // by block: a neighbour changed since it was last tried
};

}  // namespace

SeamMatch match_seams(const SeamBlocks& blocks, std::span<const SeamEquation> equations) {
  return Matcher(blocks, equations).run();
}

}  // namespace kiln
