#!/bin/sh
# The script `kiln` at the root: it builds if and only if a source is newer than the programs, and says so. With a
# compiler, a package manager and programs that only tell what they were asked.
set -eu
script="$1"
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
fail() { echo "FAILED: $1"; cat "$tree/out" "$tree/err"; exit 1; }
stub() { printf '#!/bin/sh\n%s\n' "$2" >"$tree/$1"; chmod +x "$tree/$1"; }

mkdir -p "$tree/cmake" "$tree/common" "$tree/coordinator" "$tree/worker" "$tree/build/bin" "$tree/path"
cp "$script" "$tree/kiln"
touch "$tree/CMakeLists.txt" "$tree/common/a.cpp" "$tree/build/build.ninja"
stub build/bin/kiln 'echo "kiln $*"'
stub build/bin/kiln-worker ''
# shellcheck disable=SC2016
stub path/cmake 'echo "[1/1] compiling $*"; echo built >>"$KILN_TEST_BUILDS"; exit "${KILN_TEST_STATUS:-0}"'
stub path/dpkg-query 'echo "install ok installed"'
export KILN_TEST_BUILDS="$tree/builds" PATH="$tree/path:$PATH"
builds() { if [ -f "$tree/builds" ]; then wc -l <"$tree/builds"; else echo 0; fi; }
kiln() { "$tree/kiln" "$@" >"$tree/out" 2>"$tree/err"; }

kiln version || fail "the first command ends with $?"
[ "$(builds)" -eq 1 ] || fail "the first command builds once"
grep -q 'kiln: building' "$tree/err" || fail "it says that it builds"
[ "$(cat "$tree/out")" = "kiln version" ] || fail "the program gets the arguments, and its output stands alone"
grep -q 'compiling' "$tree/build/programs.log" || fail "the log has the build's output"

kiln plan "a b" || fail "the second command ends with $?"
[ "$(builds)" -eq 1 ] || fail "where nothing changed nothing is built"
[ ! -s "$tree/err" ] || fail "and nothing is said"

sleep 0.02
touch "$tree/common/a.cpp"
if KILN_TEST_STATUS=1 kiln version; then fail "a build that fails ends the command"; fi
[ "$(builds)" -eq 2 ] || fail "a newer source is built"
[ ! -s "$tree/out" ] || fail "the program of before does not run"
kiln version || fail "after a failure the next command ends with $?"
[ "$(builds)" -eq 3 ] || fail "after a failure it is built again"

sleep 0.02
touch "$tree/worker/new.cpp"
kiln version || fail "with a new file it ends with $?"
[ "$(builds)" -eq 4 ] || fail "a new file is built"
echo "the script builds what changed, and only that"
