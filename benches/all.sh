#!/usr/bin/env bash
# Makes the tables of this folder anew, one after another, on a machine that does nothing else:
#   benches/all.sh [NAME ...]     all of them, or some of: floor scaling criterion peers search_quality repeat strangers
# PYTHON names a Python with what the requirements.txt in here ask for. A table that fails keeps its old figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=${PYTHON:-python3}
names=("$@")
[ $# -gt 0 ] || names=(floor scaling criterion peers search_quality repeat strangers)

# What a command prints takes the place of a file, once it has ended well.
into() {
    local file=$1
    shift
    "$@" > "$file.part" && mv "$file.part" "$file"
}

for name in "${names[@]}"; do
    echo "== $name, $(date +%T)"
    case $name in
        floor) into benches/floor.md cargo bench --quiet --bench floor ;;
        scaling)
            into benches/scaling/results.csv cargo bench --quiet --bench scaling
            "$python" benches/scaling/plot.py
            ;;
        criterion)
            cargo bench --bench evaluators --bench search --bench diagnosis
            "$python" benches/criterion_table.py
            ;;
        peers) "$python" benches/peers/compare.py ;;
        search_quality) "$python" benches/search_quality/compare.py ;;
        repeat)
            cargo build --release --locked
            into benches/repeat.md "$python" benches/repeat.py
            ;;
        strangers)
            cargo build --release --locked
            "$python" benches/strangers/strangers.py --program target/release/servobee --seeds 61,62
            ;;
        *) echo "all.sh: there is no table $name" >&2 && exit 2 ;;
    esac
done
