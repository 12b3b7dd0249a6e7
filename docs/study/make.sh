#!/usr/bin/env bash
# Makes the studies that docs/studies.md shows again, in place, and the figures of its captions: a minute for each scene, and the build.
# For a machine that does nothing else. The estimator from which they turn is the hand-out's.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
cargo build --release
octolux=${CARGO_TARGET_DIR:-target}/release/octolux
mkdir -p target/study
for scene in veach-mis knot many-spheres; do
  "$octolux" study "scenes/$scene.toml" --estimator mis -o "target/study/$scene" --budget "${BUDGET:-60s}"
  mkdir -p "docs/study/$scene"
  cp "target/study/$scene"/{error-over-time.svg,same-picture.svg,study.json} "docs/study/$scene/"
done
python3 docs/study/captions.py
