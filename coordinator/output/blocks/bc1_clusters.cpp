#include "coordinator/output/blocks/bc1_clusters.h"

#include <numeric>

namespace kiln {
namespace {

// Prefix sums over the first n texels in order: weight, and weight times the three colours minus their mean.
struct Prefix {
  alignas(64) float of[4][17];
};

KILN_WIDE void search(const Prefix& prefix, const float* channel, float (*ends)[4]) {
  float most = -1;
  for (int i = 1; i < 16; ++i)
    for (int j = i; j < 16; ++j) {
      // For all ends k of the third run at once; those before j are not divisions.
      alignas(64) float aa[16], ab[16], bb[16], gain[16], x[3][16], y[3][16];
      for (int k = 0; k < 16; ++k) {
        const float* w = prefix.of[0];
        const float first = w[j] - w[i], second = w[k] - w[j];
        aa[k] = w[i] + first * (4.0f / 9) + second * (1.0f / 9);
        ab[k] = (first + second) * (2.0f / 9);
        bb[k] = first * (1.0f / 9) + second * (4.0f / 9) + (w[16] - w[k]);
      }
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 16; ++k) {
          const float* v = prefix.of[1 + c];
          x[c][k] = v[i] + (v[j] - v[i]) * (2.0f / 3) + (v[k] - v[j]) * (1.0f / 3);
          y[c][k] = (v[j] - v[i]) * (1.0f / 3) + (v[k] - v[j]) * (2.0f / 3) + (v[16] - v[k]);
        }
      for (int k = 0; k < 16; ++k) {
        float sum = 0;
        for (int c = 0; c < 3; ++c)
          sum += channel[c] *
                 (bb[k] * x[c][k] * x[c][k] - 2 * ab[k] * x[c][k] * y[c][k] + aa[k] * y[c][k] * y[c][k]);
        const float det = aa[k] * bb[k] - ab[k] * ab[k];
        gain[k] = k >= j && det > 1e-4f ? sum / det : -1.0f;
      }
      for (int k = j; k < 16; ++k) {
        if (!(gain[k] > most)) continue;
        most = gain[k];
        const float inverse = 1.0f / (aa[k] * bb[k] - ab[k] * ab[k]);
        for (int c = 0; c < 3; ++c) {
          ends[0][c] = (bb[k] * x[c][k] - ab[k] * y[c][k]) * inverse;
          ends[1][c] = (aa[k] * y[c][k] - ab[k] * x[c][k]) * inverse;
        }
      }
    }
}

}  // namespace

void cluster_ends(const BlockLanes& lanes, float (*ends)[4]) {
  float along[16], mean[3], total = 0;
  for (int i = 0; i < 16; ++i) {
    along[i] = 0;
    total += lanes.weight[i];
    for (int c = 0; c < 3; ++c) along[i] += lanes.channel[c] * (ends[1][c] - ends[0][c]) * lanes.v[c][i];
  }
  for (int c = 0; c < 3; ++c) {
    mean[c] = 0;
    for (int i = 0; i < 16; ++i) mean[c] += lanes.weight[i] * lanes.v[c][i];
    mean[c] /= total;
  }
  int order[16];
  std::iota(order, order + 16, 0);
  std::stable_sort(order, order + 16, [&](int a, int b) { return along[a] < along[b]; });
  Prefix prefix{};
  for (int n = 0; n < 16; ++n) {
    const int i = order[n];
    prefix.of[0][n + 1] = prefix.of[0][n] + lanes.weight[i];
    for (int c = 0; c < 3; ++c)
      prefix.of[1 + c][n + 1] = prefix.of[1 + c][n] + lanes.weight[i] * (lanes.v[c][i] - mean[c]);
  }
  float found[2][4] = {};
  search(prefix, lanes.channel, found);
  for (int e = 0; e < 2; ++e)
    for (int c = 0; c < 3; ++c) ends[e][c] = in_byte(mean[c] + found[e][c]);
}

}  // namespace kiln
