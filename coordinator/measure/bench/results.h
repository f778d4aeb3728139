// Results of a bench, for people and machines.
#pragma once

#include "coordinator/measure/bench/bench.h"
#include "coordinator/measure/bench/error_plot.h"

namespace kiln {

std::string bench_json(const BenchResult& result);   // every run with its settings, medians, crossings
std::string bench_csv(const BenchResult& result);    // one line per run
std::string bench_table(const BenchResult& result);  // times to the targets, in Markdown
ErrorPlot bench_plot(const BenchResult& result);     // relMSE against seconds and against rays

// Writes bench.json, bench.csv and, if there are runs, bench.svg and bench.png into the folder.
Status write_bench(const BenchResult& result, const std::filesystem::path& folder);

}  // namespace kiln
