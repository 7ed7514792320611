#!/usr/bin/env bash
# Compares the names of the public surface, as `cargo doc` lists them, with tests/surface.txt: what disappears breaks somebody's
# program, and what appears has to be kept. With --bless the list is written anew; a name that is gone asks for a new minor
# version (0.x) in Cargo.toml.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --locked --quiet
list=${CARGO_TARGET_DIR:-target}/doc/servobee/all.html
names() {
    grep -oE 'href="[^"#]+\.html"' "$list" | sed -E 's/href="(.*)\.html"/\1/' | grep '\.' | LC_ALL=C sort -u
}
if [ "${1:-}" = --bless ]; then
    names > tests/surface.txt
elif ! diff <(names) tests/surface.txt; then
    echo 'surface.sh: the public surface has changed: bash tests/surface.sh --bless writes the new list' >&2
    exit 1
fi
