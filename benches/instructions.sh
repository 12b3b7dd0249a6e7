#!/bin/sh
# Counts the instructions of a diffuse-only scene, with the kernel that holds its needs alone (what the table gives) and with one
# effect after another held as well: `sh benches/instructions.sh` after `cargo build --release`. Counts repeat; times need not.
# Valgrind hides AVX-512, so packets are of eight; Embree's own instructions are left out of nothing.
set -eu
cd "$(dirname "$0")/.."
scene=${1:-benches/veach-diffuse.toml}
count() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null target/release/octolux render "$scene" \
    --size 96x64 --spp 16 --threads 1 --lanes 8 -q -o "$out" $1 2>&1 | sed -n 's/.*Collected : //p'
}
out=$(mktemp -d)/x.npy
own=$(count "")
echo "own needs $own"
for effect in phong smooth-normals one-sided textures lens blend; do
  with=$(count "--hold $effect")
  echo "$effect $with $(awk "BEGIN { printf \"%+.2f %%\", 100 * ($with / $own - 1) }")"
done
