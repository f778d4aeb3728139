#!/bin/sh
# Builds the fuzz targets with clang and runs each for SECONDS: tests/fuzz/run.sh 60 [TARGET ...]
# Prints a line a target: runs, coverage (edges), new inputs, crashes. Exit status 1 if anything crashed; the
# inputs are then in build-fuzz/crashes. KILN_FUZZ_BUILD names another build folder.
set -eu
seconds=${1:?usage: tests/fuzz/run.sh SECONDS [TARGET ...]}
shift
root=$(cd "$(dirname "$0")/../.." && pwd)
build=${KILN_FUZZ_BUILD:-$root/build-fuzz}
cmake -S "$root" -B "$build" -G Ninja -DKILN_FUZZ=ON -DCMAKE_CXX_COMPILER=clang++-14 -DCMAKE_C_COMPILER=clang-14 \
  -DCMAKE_BUILD_TYPE=Release > "$build.log" 2>&1 || { cat "$build.log"; exit 2; }
targets=${*:-$(tr ';' ' ' < "$build/fuzz_targets.txt")}
ninja -C "$build" $(for t in $targets; do echo "fuzz_$t"; done) >> "$build.log" 2>&1 || { tail -50 "$build.log"; exit 2; }

# What a decoder may take: above 1 GiB or 20 s on one small input is a finding too. Leaks are looked for.
export ASAN_OPTIONS=allocator_may_return_null=0:detect_stack_use_after_return=1
export UBSAN_OPTIONS=print_stacktrace=1
# OpenImageIO keeps the last error of a file that failed for the thread's life.
echo "leak:OpenImageIO" > "$build/leaks.txt"
export LSAN_OPTIONS=suppressions=$build/leaks.txt:print_suppressions=0
failed=0
for t in $targets; do
  found="$build/found/$t"
  mkdir -p "$found" "$build/crashes"
  log="$build/fuzz_$t.log"
  status=0
  "$build/bin/fuzz_$t" -max_total_time="$seconds" -max_len=65536 -rss_limit_mb=2048 -malloc_limit_mb=1280 \
    -timeout=20 -print_final_stats=1 -artifact_prefix="$build/crashes/$t-" "$found" "$root/tests/fuzz/corpus/$t" \
    > "$log" 2>&1 || status=$?
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
  cover=$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' "$log" | tail -1)
  crashes=$(find "$build/crashes" -type f -name "$t-*" | wc -l)
  printf '%-12s %10s runs  %6s edges  %5s inputs  %3s crashes%s\n' "$t" "${runs:-?}" "${cover:-?}" \
    "$(find "$found" -type f | wc -l)" "$crashes" "$([ "$status" = 0 ] || echo "  see $log")"
  [ "$status" = 0 ] || failed=1
done
exit $failed
