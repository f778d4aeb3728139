// Sites in parallel, in runs that share what is costly to set up.
#pragma once

#include <algorithm>

#include "common/base/parallel.h"

namespace kiln {

constexpr size_t kSiteRun = 1024;

// Calls body(begin, end) for runs that together are [0, sites).
template <class Body>
void for_each_run(size_t sites, unsigned threads, const Body& body) {
  parallel_for((sites + kSiteRun - 1) / kSiteRun,
               [&](size_t run) { body(run * kSiteRun, std::min(sites, (run + 1) * kSiteRun)); }, threads);
}

template <class Body>
void for_each_site(size_t sites, unsigned threads, const Body& body) {
  for_each_run(sites, threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) body(i);
  });
}

}  // namespace kiln
