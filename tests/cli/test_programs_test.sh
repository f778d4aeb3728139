#!/bin/sh
# What `./kiln test` installs for tests that use other programs: what is absent, and nothing else; and that it goes on
# where it may not, cannot, or is told not to. With package managers that only tell what they were asked.
set -eu
script="$1"
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
fail() { echo "FAILED: $1"; cat "$tree/out" "$tree/err" "$tree/asked"; exit 1; }
stub() { printf '#!/bin/sh\n%s\n' "$2" >"$tree/$1"; chmod +x "$tree/$1"; }

mkdir -p "$tree/build" "$tree/path"
cp "$script" "$tree/kiln"
touch "$tree/build/build.ninja"
for folder in tests/node tests/node/engines tests/compare docs/examples/three; do
  mkdir -p "$tree/$folder"
  touch "$tree/$folder/package-lock.json"
done
# Nothing of this machine but what the script itself uses.
for program in sh dirname env find grep tail tr mktemp rm mv cat mkdir touch sleep; do
  ln -s "$(command -v "$program")" "$tree/path/$program"
done
# shellcheck disable=SC2016
{
  stub path/id 'echo "${KILN_TEST_USER:-0}"'
  stub path/cmake ''
  stub path/ctest 'echo "ctest $*, without <${KILN_TEST_WITHOUT-unset}>" >>"$KILN_TEST_ASKED"'
  # Installed is what KILN_TEST_ABSENT does not name.
  stub path/dpkg-query 'for last; do :; done
case " $KILN_TEST_ABSENT " in *" $last "*) exit 1 ;; esac
echo "install ok installed"'
  stub path/apt-get 'echo "apt-get $*" >>"$KILN_TEST_ASKED"
case "$*" in *"${KILN_TEST_FAILS:-nothing at all}"*) echo "E: no such thing"; exit 100 ;; esac'
}
make_npm() {
  # shellcheck disable=SC2016
  stub path/npm 'echo "npm $2 ${3#"$KILN_TEST_TREE/"}" >>"$KILN_TEST_ASKED"
[ -z "${KILN_TEST_OFFLINE:-}" ] || { echo "npm ERR! network"; exit 1; }
mkdir -p "$3/node_modules"; touch "$3/node_modules/.package-lock.json"'
}
make_npm
export KILN_TEST_ASKED="$tree/asked" KILN_TEST_TREE="$tree" KILN_TEST_ABSENT="" PATH="$tree/path"
run() { : >"$tree/asked"; "$tree/kiln" test "$@" >"$tree/out" 2>"$tree/err"; }
run_with() { (export "$1"; shift; run "$@"); }  # NAME=VALUE in the environment
asked() { grep -q -e "$1" "$tree/asked"; }
said() { grep -q -e "$1" "$tree/err"; }

KILN_TEST_ABSENT="blender python3-numpy godot3 mkdocs nodejs npm"
run -R Furnace || fail "it ends with $?"
asked '^apt-get install .*--no-install-recommends nodejs$' || fail "the first group's package that is absent, and npm, whose program is there, is not asked for"
asked '^apt-get install .*--no-install-recommends blender python3-numpy$' || fail "the second group's"
asked '^apt-get install .*--no-install-recommends godot3$' || fail "of a group only what is absent"
asked '^apt-get install .*--no-install-recommends mkdocs$' || fail "the last group's"
[ "$(grep -c 'apt-get update' "$tree/asked")" -eq 1 ] || fail "the list of packages is fetched once"
for folder in tests/node tests/node/engines tests/compare docs/examples/three; do
  asked "^npm --prefix $folder$" || fail "npm installs into $folder"
done
asked '^ctest .*-R Furnace, without <>$' || fail "ctest gets its arguments"
said 'kiln: installing for tests of the add-on for Blender: blender python3-numpy' || fail "it says what it installs"

KILN_TEST_ABSENT=""
run || fail "the second run ends with $?"
if asked apt-get || asked npm || [ -s "$tree/err" ]; then fail "where all is there nothing is installed and nothing said"; fi

sleep 0.02
touch "$tree/tests/node/package-lock.json"
run || fail "with a newer lock file it ends with $?"
[ "$(grep -c npm "$tree/asked")" -eq 1 ] || fail "the folder whose lock file is newer is installed again"

KILN_TEST_ABSENT="blender godot3"
run_with KILN_TEST_FAILS="install -y --no-install-recommends blender" || fail "a failed download ends it with $?"
said 'no such thing' && said 'tests of the add-on for Blender are skipped: could not install blender' || fail "it says what failed"
asked '^apt-get install .*godot3$' && asked '^ctest' || fail "and goes on"

touch "$tree/tests/compare/package-lock.json"
run_with KILN_TEST_OFFLINE=1 || fail "a failure of npm ends it with $?"
said 'npm ERR' && said "glTF's validator are skipped: npm could not install what tests/compare needs" || fail "it says so of npm too"
asked '^ctest' || fail "and goes on after it"
run || fail "and installs it the next time"

KILN_TEST_ABSENT="blender"
run_with KILN_TEST_USER=1000 || fail "without rights it ends with $?"
said 'tests of the add-on for Blender are skipped: neither root nor sudo, to install blender' || fail "without rights it says so"
if asked apt-get; then fail "without rights it installs nothing"; fi
asked '^ctest' || fail "without rights it goes on"
KILN_TEST_ABSENT="g++"
if run_with KILN_TEST_USER=1000; then fail "what the build needs is not left out"; fi

KILN_TEST_ABSENT="blender godot3"
run --without blender,docs -R x || fail "with --without it ends with $?"
asked 'ctest .*-R x, without <blender docs>' || fail "tests know what is left out"
if asked '--no-install-recommends blender'; then fail "what is left out is not installed"; fi
asked 'godot3' || fail "the others are"
run --without all || fail "with --without all it ends with $?"
asked 'ctest .*, without <web blender godot docs>' || fail "all is every group"
if asked apt-get; then fail "and nothing is installed"; fi
for wrong in blendr ""; do
  if run --without $wrong; then fail "an unknown group is refused"; fi
  said 'choose from web, blender, godot, docs, or all' || fail "with the names that there are"
done
echo "the script installs what tests use, says what it could not, and goes on"
