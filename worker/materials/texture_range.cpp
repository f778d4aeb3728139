// Bounds alpha() on a triangle by conservative rasterisation in texels.
#include "worker/materials/texture_sampler.h"

namespace kiln {
namespace {

int64_t wrapped_index(int64_t i, int64_t size, Wrap mode) {
  if (mode == Wrap::kClamp) return std::clamp<int64_t>(i, 0, size - 1);
  const int64_t period = mode == Wrap::kMirror ? 2 * size : size;
  i = (i % period + period) % period;
  return i < size ? i : 2 * size - 1 - i;
}

void include(Range& r, float x) {
  r.low = std::min(r.low, x);
  r.high = std::max(r.high, x);
}

// The x range of a triangle within low <= y <= high; empty (low > high) if there is none.
Range slab(const DVec2 (&p)[3], double low, double high) {
  Range out{3e38f, -3e38f};
  for (int k = 0; k < 3; ++k) {
    const DVec2 a = p[k], b = p[(k + 1) % 3];
    if (a.y >= low && a.y <= high) include(out, static_cast<float>(a.x));
    for (const double y : {low, high})
      if ((a.y < y) != (b.y < y))
        include(out, static_cast<float>(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y)));
  }
  return out;
}

}  // namespace

Range TextureSampler::alpha_range() const {
  if (texture_->channels == 1 || texture_->channels == 3) return {1.0f, 1.0f};
  Range r{alpha_texel(0), alpha_texel(0)};
  for (size_t i = 1; i < static_cast<size_t>(width_) * static_cast<size_t>(height_); ++i)
    include(r, alpha_texel(i));
  return r;
}

std::optional<Range> TextureSampler::alpha_range(const Vec2 (&a)[2], const Vec2 (&b)[2],
                                                 const Vec2 (&c)[2]) const {
  if (texture_->channels == 1 || texture_->channels == 3) return Range{1.0f, 1.0f};
  const Vec2 uv[3] = {a[use_.uv_set], b[use_.uv_set], c[use_.uv_set]};
  DVec2 p[3];
  double reach = 0;
  for (int k = 0; k < 3; ++k) {
    const double u = double{use_.m[0]} * uv[k].x + double{use_.m[1]} * uv[k].y + use_.m[2];
    const double v = double{use_.m[3]} * uv[k].x + double{use_.m[4]} * uv[k].y + use_.m[5];
    reach = std::max({reach, std::abs(u), std::abs(v)});
    for (int i = 0; i < 3; ++i)  // the terms of the sums above bound their float rounding
      reach = std::max({reach, std::abs(double{use_.m[i]}), std::abs(double{use_.m[i + 3]}),
                        std::abs(double{use_.m[i]} * uv[k].x), std::abs(double{use_.m[i + 3]} * uv[k].y)});
    p[k] = {u * width_, v * height_};
  }
  if (!(reach < 9e3)) return std::nullopt;
  const double margin = 0.01 + reach * 0x1p-20 * std::max(width_, height_);
  const auto first = [&](double x) { return static_cast<int64_t>(std::floor(x - 0.5 - margin)); };
  const auto last = [&](double x) { return static_cast<int64_t>(std::floor(x - 0.5 + margin)) + 1; };
  const int64_t top = first(std::min({p[0].y, p[1].y, p[2].y})),
                bottom = last(std::max({p[0].y, p[1].y, p[2].y}));
  const bool repeats = texture_->wrap_t != Wrap::kClamp;
  if (repeats && bottom - top >= height_) return std::nullopt;
  Range r{3e38f, -3e38f};
  for (int64_t y = repeats ? top : std::max<int64_t>(top, -1);
       y <= (repeats ? bottom : std::min<int64_t>(bottom, height_)); ++y) {
    // All points whose lookup reads this row; past a clamped edge every point reads the edge row.
    const double low = !repeats && y < 0 ? p[0].y - 1e9 : static_cast<double>(y) - 0.5 - margin;
    const double high = !repeats && y >= height_ ? p[0].y + 1e9 : static_cast<double>(y) + 1.5 + margin;
    const Range x = slab(p, low, high);
    if (x.low > x.high) continue;
    int64_t left = first(x.low), right = last(x.high);
    if (texture_->wrap_s == Wrap::kClamp) {
      left = std::clamp<int64_t>(left, 0, width_ - 1);
      right = std::clamp<int64_t>(right, 0, width_ - 1);
    } else if (right - left >= width_) {
      return std::nullopt;
    }
    const int64_t row = wrapped_index(y, height_, texture_->wrap_t) * width_;
    for (int64_t i = left; i <= right; ++i)
      include(r, alpha_texel(static_cast<size_t>(row + wrapped_index(i, width_, texture_->wrap_s))));
  }
  if (r.low > r.high) return std::nullopt;
  return r;
}

}  // namespace kiln
