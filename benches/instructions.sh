#!/bin/sh
# Counts the instructions of a sample of a diffuse-only scene, with the stages that the table gives and with those that it gives for
# one effect more: `sh benches/instructions.sh [SCENE]` after `cargo build --release`, half a minute. What 32 passes take beyond 16
# others is counted, so that start-up and files are left out. Counts repeat; times need not. Valgrind hides AVX-512, so packets are
# of eight.
set -eu
cd "$(dirname "$0")/.."
scene=${1:-benches/veach-diffuse.toml}
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
collected() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null target/release/octolux render "$scene" --size 96x64 --spp "$1" \
    --threads 1 --lanes 8 --estimator mis -q -o "$folder/x.npy" $2 2>&1 | sed -n 's/.*Collected : //p'
}
per_sample() {
  few=$(collected 16 "$1")
  more=$(collected 48 "$1")
  awk "BEGIN { printf \"%.1f\", ($more - $few) / (96 * 64 * 32) }"
}
own=$(per_sample "")
echo "own needs: $own instructions a sample"
for effect in phong smooth-normals one-sided textures blend environment lens; do
  with=$(per_sample "--hold $effect")
  echo "$effect held: $with, $(awk "BEGIN { printf \"%+.1f %%\", 100 * ($with / $own - 1) }")"
done
