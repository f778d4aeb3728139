#!/bin/sh
# Installs the packages in a bare Debian 12 tree, uses them as a new user would, and removes them.
#
# usage: sudo bare.sh FOLDER-OF-PACKAGES [TREE]
#
# TREE is made with debootstrap where it is not there (two minutes, from Debian's mirror); by default it goes at the end.
# Exit status: 0 all held, 1 something did not, 77 this machine cannot (no root, no debootstrap).
set -eu
packages=$(CDPATH='' cd -- "${1:?usage: bare.sh FOLDER-OF-PACKAGES [TREE]}" && pwd)
source=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
[ "$(id -u)" = 0 ] || { echo "skipped: not root"; exit 77; }
command -v debootstrap >/dev/null || { echo "skipped: debootstrap is not installed"; exit 77; }
own=""
tree=${2:-}
if [ -z "$tree" ]; then
  tree=$(mktemp -d)/tree
  own=$(dirname "$tree")
fi
server=""
worker=""
leave() {
  [ -z "$server" ] || kill "$server" "$worker" 2>/dev/null || true
  umount "$tree/proc" 2>/dev/null || true
  [ -z "$own" ] || rm -rf --one-file-system "$own"
}
trap leave EXIT

inside() { chroot "$tree" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
             DEBIAN_FRONTEND=noninteractive "$@"; }
fails() { echo "FAILED: $*"; exit 1; }

if ! [ -x "$tree/usr/bin/apt-get" ]; then
  debootstrap --variant=minbase --include=man-db,bash-completion,ca-certificates bookworm "$tree" >"$packages/debootstrap.log" 2>&1 ||
    { tail -n 3 "$packages/debootstrap.log"; echo "skipped: debootstrap cannot work here"; exit 77; }
fi
cp /etc/resolv.conf "$tree/etc/resolv.conf"
mount -t proc none "$tree/proc"
# A minimal tree leaves out what this test is about.
rm -f "$tree/etc/dpkg/dpkg.cfg.d/"*
inside apt-get update >/dev/null

rm -rf "$tree/root/farm" "$tree/root/out" "$tree/root/fetched" "$tree/root/cache"
cp "$packages"/kiln_*.deb "$packages"/kiln-worker_*.deb "$tree/root/"
cp -r "$source/tests/scenes/arcade" "$tree/root/"
echo "a machine of workers: $(inside sh -c 'apt-get install -y --no-install-recommends -s /root/kiln-worker_*.deb' |
  grep -c '^Inst') packages"
inside sh -c 'apt-get install -y --no-install-recommends /root/kiln-worker_*.deb /root/kiln_*.deb' >"$packages/apt.log" 2>&1 ||
  { tail -n 20 "$packages/apt.log"; fails "apt install"; }
inside kiln version
inside sh -c 'cd /root && kiln bake arcade/arcade.gltf -o out --texels-per-metre 2 --time-limit 20 --quiet' ||
  fails "the demo does not bake"
[ -s "$tree/root/out/scene.glb" ] || fails "no scene.glb"
[ -f "$tree/usr/share/kiln/examples/three/node_modules/three/build/three.module.js" ] || fails "no three.js for kiln view"

inside kiln serve --data /root/farm --listen 127.0.0.1:7899 >/dev/null 2>"$packages/serve.log" &
server=$!
asked="KILN_SERVER=127.0.0.1:7899 KILN_TOKEN_FILE=/root/farm/admin.token"
for _ in $(seq 100); do inside $asked kiln jobs >/dev/null 2>&1 && break; sleep 0.1; done
inside KILN_CONNECT=127.0.0.1:7899 kiln-worker --token-file /root/farm/worker.token --cache /root/cache >/dev/null \
  2>"$packages/worker.log" &
worker=$!
inside $asked sh -c 'cd /root &&
  kiln submit arcade/arcade.gltf --texels-per-metre 1 --max-samples 64 && kiln watch 1 && kiln fetch 1 -o fetched' \
  >"$packages/farm.log" 2>&1 || { tail -n 5 "$packages/farm.log" "$packages/worker.log"; fails "the farm does not bake"; }
[ -s "$tree/root/fetched/scene.glb" ] || fails "nothing was fetched"
kill "$server" "$worker"; wait 2>/dev/null || true
server=""

inside man kiln-bake | grep -q 'texels-per-metre' || fails "man kiln-bake"
inside man kiln-worker | grep -q 'KILN_CONNECT' || fails "man kiln-worker"
inside bash -c '. /usr/share/bash-completion/bash_completion; _completion_loader kiln || true; complete -p kiln' |
  grep -q _kiln || fails "completion"
for unit in kiln-serve.service kiln-worker@.service; do
  grep -q '^ExecStart=/usr/bin/kiln' "$tree/usr/lib/systemd/system/$unit" || fails "$unit names no installed program"
done

listed=$(inside dpkg -L kiln kiln-worker | sort -u)
inside apt-get remove -y --purge kiln kiln-worker >/dev/null
for file in $listed; do
  [ -f "$tree$file" ] && fails "$file is left"
done
[ -d "$tree/usr/share/kiln" ] && fails "/usr/share/kiln is left"
[ -s "$tree/root/farm/kiln.db" ] || fails "the data went too"
echo "installed, baked, joined by a worker, read, completed, removed: all held"
