#!/usr/bin/env bash
# The long forms of the tests that tests/run.sh runs short: hours, not minutes. Run by hand before a release.
#
#   bash tests/soak.sh [PART...]
#
# Parts, all of them without arguments:
#   debug     every test with the checks of debug builds: overflows, assertions
#   kill      runs killed a hundred times; 64 runs side by side; huge files; every effect on the GPU, wherever it may be
#   mpi       ranks under mpirun
#   outside   a crate that depends on this one, built in a folder of its own
#   load      a hundred records of a million rows in one call
#   fuzz      every fuzz target for SERVOBEE_FUZZ_SECONDS (3600)
#   mutants   about SERVOBEE_MUTANTS (120) of the mutants of model, search and diagnosis
#   sanitize  the tests under the address sanitiser, and unsafe code under Miri where it is installed
#   supply    licences, sources and advisories of what is linked
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

missing() {
    echo "NOT TESTED: $1: $2 is missing"
}

debug_part() {
    cargo test --locked
}

kill_part() {
    SERVOBEE_SOAK=1 cargo test --release --locked --test all -- --show-output resume:: surroundings:: identify:: diagnosis:: \
        effects:: faults:: simulator::
    SERVOBEE_HUGE=1 cargo test --release --locked --test all -- --show-output bad::
}

mpi_part() {
    command -v mpicc > /dev/null || { missing ranks "MPI (libopenmpi-dev, openmpi-bin, libclang-dev)"; return; }
    bash tests/mpi.sh
    cargo clippy --release --workspace --all-targets --features servobee/mpi --locked -- -D warnings
    SERVOBEE_MPI_PROGRAM=$PWD/target/mpi/servobee cargo test --release --locked --workspace --test all -- --show-output mpi::
}

outside_part() {
    local outside=target/outside
    mkdir -p "$outside"
    cp tests/outside/main.rs Cargo.lock "$outside/"
    { cat tests/outside/Cargo.toml && echo '[workspace]'; } > "$outside/Cargo.toml"
    [ "$(cargo run --release --quiet --manifest-path "$outside/Cargo.toml" -- tests/data/bench.csv)" = delay ]
}

load_part() {
    cargo build --release --locked
    python3 tests/load.py target/release/servobee
}

fuzz_part() {
    cargo fuzz --version > /dev/null 2>&1 || { missing fuzz "cargo-fuzz (cargo install cargo-fuzz)"; return; }
    bash tests/fuzz/run.sh "${SERVOBEE_FUZZ_SECONDS:-3600}"
}

mutants_part() {
    cargo mutants --version > /dev/null 2>&1 || { missing mutants "cargo-mutants (cargo install cargo-mutants)"; return; }
    # Every n-th one, so that each file has its share. Named by -C, these tests are all that is built for each mutant.
    local among=(-f 'src/model/**' -f 'src/search/**' -f 'src/diagnose/**') count
    count=$(cargo mutants --list "${among[@]}" | wc -l)
    SERVOBEE_SKIP_GPU=1 SERVOBEE_SKIP_BROWSER=1 cargo mutants "${among[@]}" --sharding round-robin \
        --shard "0/$((count / ${SERVOBEE_MUTANTS:-120}))" --output target --timeout-multiplier 3 -C=--lib -C=--test=all \
        -- -- tests effects:: physics:: shader:: bees:: polish:: own:: evaluators:: card:: numbers:: diagnosis:: identify:: html::
}

sanitize_part() {
    local host
    host=$(rustc -vV | sed -n 's/^host: //p')
    # The sanitiser and Miri are not in stable Rust.
    if cargo +nightly --version > /dev/null 2>&1; then
        RUSTFLAGS=-Zsanitizer=address cargo +nightly test --locked --target "$host" --target-dir target/sanitize \
            --lib --test all -- evaluators:: physics:: tests
    else
        missing "address sanitiser" "a nightly toolchain"
    fi
    if cargo +nightly miri --version > /dev/null 2>&1; then
        cargo +nightly miri test --lib audited
    else
        missing Miri "rustup component add miri --toolchain nightly"
    fi
}

supply_part() {
    cargo deny --version > /dev/null 2>&1 || { missing supply "cargo-deny (cargo install cargo-deny)"; return; }
    cargo deny --config .ci/deny.toml check licenses bans sources
    if cargo deny --config .ci/deny.toml fetch db > /dev/null 2>&1; then
        cargo deny --config .ci/deny.toml check advisories
    else
        missing advisories "their database, which is fetched from the network"
    fi
}

parts=("$@")
[ $# -gt 0 ] || parts=(debug kill mpi outside load fuzz mutants sanitize supply)
for part in "${parts[@]}"; do
    declare -F "${part}_part" > /dev/null || { echo "soak.sh: there is no part $part" >&2; exit 2; }
    echo "soak.sh: $part"
    "${part}_part"
done
