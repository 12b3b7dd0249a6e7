#!/bin/sh
# Makes the lamps and houses of city.toml: two PLY files in scenes/fetched/, which git ignores. Needs python3 alone.
set -eu
cd "$(dirname "$0")"
exec python3 city.py fetched
