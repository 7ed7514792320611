#!/usr/bin/env bash
# Builds the program with the feature mpi as target/mpi/servobee, for the tests of ranks and for benches/ranks. It needs mpicc and
# libclang (Debian: libopenmpi-dev, openmpi-bin, libclang-dev).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Of the whole workspace like the rest, which shares what is compiled.
cargo build --release --locked --workspace --bin servobee --features servobee/mpi
mkdir -p target/mpi
cp "${CARGO_TARGET_DIR:-target}/release/servobee" target/mpi/servobee
