#!/usr/bin/env bash
# Fuzzes what reads files, and the whole of identify, all at once: bash tests/fuzz/run.sh [SECONDS [TARGET...]]
#
# Needs a nightly toolchain and cargo-fuzz; SERVOBEE_FUZZ_BIN names a folder with targets that are built. What is found, the
# corpora and the counts stay in target: fuzz-corpus, fuzz-found and fuzz-counts.txt, a line a run with target, seconds,
# executions, and whether something was found.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

seconds=${1:-60}
shift || true
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(record_csv record_mat record_xlsx curve model_file checkpoint identify)

# The files that a target begins with, and its own options.
seeds() {
    case $1 in
        record_csv) cp tests/data/mat/record.csv tests/data/bad/*.csv "$2" 2> /dev/null || true
            head -n 60 tests/data/bench.csv > "$2/bench.csv" ;;
        record_mat) cp tests/data/mat/*.mat tests/data/bad/*.mat "$2" 2> /dev/null || true ;;
        record_xlsx) cp tests/fuzz/seeds/record_xlsx/*.xml tests/data/bad/*.xlsx "$2" 2> /dev/null || true ;;
        curve) cp src/record/cases/*.csv "$2" ;;
        model_file) cp tests/fuzz/seeds/model_file/*.toml tests/data/bad/*.toml "$2" 2> /dev/null || true ;;
        # The second byte says which effects are looked for, and whether a card is drawn.
        identify) for kind in '\1' '\377'; do
            printf "\\5$kind\\140\\200%s" "$(seq -s ' ' 1 40)" > "$2/short${kind#?}"
        done ;;
    esac
}
options() {
    case $1 in
        record_csv | curve) echo -dict=tests/fuzz/csv.dict -max_len=4096 ;;
        record_mat | record_xlsx) echo -max_len=16384 ;;
        model_file) echo -dict=tests/fuzz/model.dict -max_len=4096 ;;
        identify) echo -max_len=1024 ;;
    esac
}

bin=${SERVOBEE_FUZZ_BIN:-}
if [ -z "$bin" ]; then
    cargo +nightly fuzz build --fuzz-dir tests/fuzz --target-dir target/fuzz
    bin=target/fuzz/$(rustc -vV | sed -n 's/^host: //p')/release
fi

# One thread: the fuzzer's other processes have the other cores.
export RAYON_NUM_THREADS=1 ASAN_OPTIONS=detect_odr_violation=0

fuzz() {
    local target=$1 result=nothing cpu executions ran TIMEFORMAT=%0U
    local corpus=target/fuzz-corpus/$target found=target/fuzz-found/$target log=target/fuzz-$target.log
    mkdir -p "$corpus" "$found"
    seeds "$target" "$corpus"
    # shellcheck disable=SC2046 # options are words
    cpu=$({ time "$bin/$target" "$corpus" $(options "$target") -max_total_time="$seconds" -timeout=30 -rss_limit_mb=1024 \
        -print_final_stats=1 -artifact_prefix="$found/" > "$log" 2>&1; } 2>&1) || result=found
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    ran=$(grep -aoE 'in [0-9]+ second' "$log" | grep -oE '[0-9]+' || echo '?')
    echo "$(date -u +%FT%TZ) $target $ran s, $cpu s of CPU, ${executions:-?} executions, $result" | tee -a target/fuzz-counts.txt
    [ "$result" = nothing ]
}

running=()
for target in "${targets[@]}"; do
    fuzz "$target" &
    running+=($!)
done
status=0
for process in "${running[@]}"; do
    wait "$process" || status=1
done
exit "$status"
