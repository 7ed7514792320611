#!/usr/bin/env bash
# Runs every test of servobee: unit, integration and documentation tests.
#
# The tests that compare the GPU with the CPU need a Vulkan driver. Where there is none, Mesa's software driver is
# installed with apt; SERVOBEE_SKIP_GPU=1 skips those tests instead, and says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

has_driver() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && return 0
    local folder
    for folder in /usr/share /usr/local/share /etc "${HOME:-/root}/.local/share"; do
        compgen -G "$folder/vulkan/icd.d/*.json" > /dev/null && return 0
    done
    return 1
}

fail() {
    printf 'run.sh: %s\n' "$@" >&2
    exit 1
}

by_hand='install one (on Debian: apt-get install mesa-vulkan-drivers), or set SERVOBEE_SKIP_GPU=1 to skip the GPU tests'

install_driver() {
    command -v apt-get > /dev/null || fail "There is no Vulkan driver and no apt-get: $by_hand"
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo > /dev/null || fail "There is no Vulkan driver and no sudo to install one: $by_hand"
        as_root=(sudo)
    fi
    echo "run.sh: no Vulkan driver: installing mesa-vulkan-drivers"
    "${as_root[@]}" apt-get update -qq &&
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -qq --no-install-recommends mesa-vulkan-drivers > /dev/null ||
        fail "Installing mesa-vulkan-drivers failed: $by_hand"
}

command -v cargo > /dev/null || fail 'There is no cargo: install Rust with rustup'
command -v cc > /dev/null || fail 'There is no C linker: install one (on Debian: apt-get install gcc libc6-dev)'
if [ "${SERVOBEE_SKIP_GPU:-}" != 1 ] && [ "$(uname -s)" = Linux ] && ! has_driver; then
    install_driver
fi

# Each test binary prints what it skips; --no-fail-fast shows every failure at once.
log=$(mktemp)
trap 'rm -f "$log"' EXIT
status=0
cargo test --locked --no-fail-fast -- --show-output 2>&1 | tee "$log" || status=$?

echo
grep -E '^test result:' "$log" | awk '
    { passed += $4; failed += $6; ignored += $8 }
    END { printf "run.sh: %d passed, %d failed, %d ignored\n", passed, failed, ignored }' || true
if grep -qE '^(SKIPPED|NOT TESTED)' "$log"; then
    echo "run.sh: not everything was tested:"
    grep -E '^(SKIPPED|NOT TESTED)' "$log" | sort -u
fi
[ "$status" -eq 0 ] || echo "run.sh: FAILED" >&2
exit "$status"
