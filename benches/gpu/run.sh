#!/usr/bin/env bash
# Everything that is measured on a GPU, in under 8 minutes, from what pack.sh has put together; README.md says what each
# figure means.
#   run.sh [--small] [--out DIR]
# --small does little of everything, for a GPU in software. Writes ADAPTER-DATE.md and .log into DIR, otherwise beside this.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
kit=$here
[ -d "$kit/bin" ] || kit=$here/../../target/gpu
out=${OUT:-$here}
small=()
while [ $# -gt 0 ]; do
    case $1 in
        --small) small=(--small) ;;
        --out) out=$2 && shift ;;
        *) echo "run.sh: $1 is not an option; there are --small and --out DIR" >&2 && exit 2 ;;
    esac
    shift
done

fail() {
    printf 'run.sh: %s\n' "$@" >&2
    exit 1
}

[ -x "$kit/bin/gpu" ] || fail "there is no $kit/bin/gpu: run benches/gpu/pack.sh first, where there is cargo"
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Vulkan: its loader, and a driver that says where it is.
if ! ldconfig -p | grep -q 'libvulkan\.so\.1'; then
    compgen -G "$kit/debs/libvulkan1_*.deb" > /dev/null ||
        fail 'the Vulkan loader is missing: install the package libvulkan1'
    for package in "$kit"/debs/*.deb; do dpkg -x "$package" "$work/root"; done
    export LD_LIBRARY_PATH="$work/root/usr/lib/x86_64-linux-gnu:$work/root/lib/x86_64-linux-gnu:${LD_LIBRARY_PATH:-}"
fi
drivers() {
    local folder
    for folder in /usr/share /usr/local/share /etc "${HOME:-/root}/.local/share" /usr/local/nvidia/share; do
        compgen -G "$folder/vulkan/icd.d/*.json" || true
    done
}
if [ -z "${VK_DRIVER_FILES:-}" ]; then
    VK_DRIVER_FILES=$(drivers | paste -sd :)
    export VK_DRIVER_FILES
fi
found=no
IFS=: read -ra files <<< "$VK_DRIVER_FILES"
for file in "${files[@]}"; do if [ -e "$file" ]; then found=yes; fi; done
[ "$found" = yes ] ||
    fail 'there is no Vulkan driver: install the package of the GPU'\''s maker (of NVIDIA'\''s libnvidia-gl-VERSION, which' \
        'has nvidia_icd.json), or for a GPU in software mesa-vulkan-drivers with --small'

adapter=$("$kit/bin/gpu" adapter "${small[@]}") || fail "no adapter can be used: is the driver's package complete?"
name=$(sed -n 's/^| adapter | \(.*\) |$/\1/p' <<< "$adapter")
if [ ${#small[@]} -eq 0 ] && grep -q '^| kind | software' <<< "$adapter"; then
    fail "the only adapter is $name, software: use --small"
fi
today=$(date -u +%F)
file=$(tr -cs 'A-Za-z0-9\n' '-' <<< "$name" | sed 's/-*$//')-$today
table=$out/$file.md
log=$out/$file.log
: > "$log"
failed=()

# Runs a command for at most so many seconds, and no longer than all may take; its output is a section of the table.
section() {
    local title=$1 limit=$2 left=$((470 - SECONDS))
    shift 2
    printf '\n## %s\n\n' "$title"
    echo "== $title, after $SECONDS s: ${1##*/} ${*:2}" >> "$log"
    [ "$limit" -le "$left" ] || limit=$left
    if [ "$limit" -le 0 ]; then
        echo 'Not run: no time was left.'
        failed+=("$title")
        return
    fi
    local status=0
    timeout "$limit" "$@" > "$work/section" 2>> "$log" || status=$?
    cat "$work/section" >> "$log"
    cat "$work/section"
    if [ "$status" -ne 0 ]; then
        printf '\n**Failed** (%s); the log says more.\n' "$status"
        failed+=("$title")
    fi
}

gpu=$kit/bin/gpu
export kit work log

# Parity of all structures and effects, and the faults that must show; in the log, here what counts.
parity_tests() {
    local filter=parity::
    [ "$1" = all ] || filter=parity::gpu_and_cpu_agree_on_every_structure
    "$kit/bin/tests" "$filter" --nocapture --test-threads=2 > "$work/parity" 2>&1
    local status=$?
    cat "$work/parity" >> "$log"
    grep -E '^test [a-z_:]+ \.\.\. |^test result' "$work/parity" | sed 's/^/- /'
    grep -q '^SKIPPED' "$work/parity" && status=1
    return $status
}
export -f parity_tests

# A command of servobee on the GPU and on the CPU: what it says, and how long it took.
both() {
    local pattern=$1 on
    shift
    echo '| on | seconds | says |'
    echo '|---|---|---|'
    for on in gpu cpu; do
        local begin end
        begin=$(date +%s.%N)
        "$kit/bin/servobee" "$@" --evaluator "$on" > "$work/said" 2>> "$log" || return 1
        end=$(date +%s.%N)
        grep -E "$pattern" "$work/said" | paste -sd ' ' > "$work/said.$on"
        echo "| $on | $(awk "BEGIN { printf \"%.2f\", $end - $begin }") | $(cat "$work/said.$on") |"
    done
}
export -f both

cuda() {
    nvcc -O3 -o "$work/row" "$kit/row.cu" || return 1
    read -r rate off < <("$work/row" "$work/work.bin") || return 1
    echo "$rate rows/s in the kernel; 99 % of its costs within $off of f64."
}
export -f cuda

jax() {
    echo '| steps a row | rows/s | 90 % of the costs within | on |'
    echo '|---|---|---|---|'
    for steps in 5 20; do
        read -r rate off device < <(python3 "$kit/jax_rows.py" "$work/work.bin" "$steps") || return 1
        echo "| $steps | $rate | $off | $device |"
    done
}
export -f jax

{
    echo "# $name, $today"
    echo
    echo "\`benches/gpu/run.sh ${small[*]}\`, commit $(cat "$kit/commit"). What the figures mean: [README.md](README.md)."
    printf '\n## Adapter\n\n%s\n' "$adapter"
    section 'Parity' 60 "$gpu" parity "${small[@]}"
    if [ ${#small[@]} -eq 0 ]; then tests=all; else tests=some; fi
    section 'Parity tests' 90 bash -c "parity_tests $tests"
    section 'Beside a kernel written by hand' 40 "$gpu" kernel "${small[@]}"
    "$gpu" work "$work/work.bin" "${small[@]}"
    if command -v nvcc > /dev/null; then
        section 'Written by hand in CUDA' 60 bash -c cuda
    else
        printf '\n## Written by hand in CUDA\n\nNot run: there is no nvcc.\n'
    fi
    if python3 -c 'import jax' 2> /dev/null; then
        section 'JAX' 60 bash -c jax
    else
        printf '\n## JAX\n\nNot run: it is not installed.\n'
    fi
    section 'Devices that fail' 30 "$gpu" faults "${small[@]}"
    if [ ${#small[@]} -eq 0 ]; then seconds=10; else seconds=2; fi
    "$kit/bin/servobee" synthesize --effect delay=0.004 --seconds "$seconds" --out "$work/record.csv" >> "$log"
    section 'Diagnosis' 90 "$gpu" diagnosis "$work/record.csv" "${small[@]}"
    section 'servobee identify' 40 bash -c 'both "^Verdict|Held-out error" identify "$kit/bench.csv"'
    if [ ${#small[@]} -eq 0 ]; then
        section 'servobee datasheet --case d675' 60 bash -c 'both "^large search" datasheet --case d675'
    fi
    section 'A million by a million' 60 "$gpu" large "${small[@]}"
    section 'Rates' 200 "$gpu" rates "${small[@]}"
    printf '\n## All of it\n\n%s s.' "$SECONDS"
    if [ ${#failed[@]} -gt 0 ]; then printf ' **Failed: %s.**' "$(IFS=,; echo "${failed[*]}")"; fi
    echo
} > "$table.part"
mv "$table.part" "$table"
echo "$table"
[ ${#failed[@]} -eq 0 ] || fail "failed: ${failed[*]}; see $log"
