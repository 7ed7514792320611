#!/usr/bin/env bash
# Runs every test of servobee: unit, integration and documentation tests.
#
# Some of them need more than Rust. What is missing is installed, from apt and into target/tools; a test group can be left
# out instead, which the summary says:
#   SERVOBEE_SKIP_GPU=1      comparisons of GPU and CPU: a Vulkan driver (Mesa's in software)
#   SERVOBEE_SKIP_BROWSER=1  the report in a browser: chromium
#   SERVOBEE_SKIP_FMU=1      exported models in other tools: Python with tests/export/requirements.txt
#   SERVOBEE_SKIP_PYTHON=1   the Python package: Python with python/tests/requirements.txt
#
# SERVOBEE_MPI=1 also tests ranks under mpirun. They need the program built once more, with other features: that takes four
# minutes, so it is done on request and by tests/soak.sh.
#
# --quick runs only what another driver, compiler or processor can break: the modules of tests/main.rs that are named below.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
QUICK=(base_model bees effects evaluators faults gpu parity physics polish record shader)

fail() {
    printf 'run.sh: %s\n' "$@" >&2
    exit 1
}

tests=()
case "$*" in
    '') ;;
    --quick)
        tests=(--test all)
        export SERVOBEE_SKIP_BROWSER=1 SERVOBEE_SKIP_FMU=1 SERVOBEE_SKIP_PYTHON=1
        ;;
    *) fail "what is $*? bash tests/run.sh runs every test, bash tests/run.sh --quick the short ones" ;;
esac

# Installs Debian packages for the tests that SERVOBEE_SKIP_$1=1 leaves out.
install() {
    local group=$1
    shift
    local by_hand="install $* (on Debian: apt-get install $*), or set SERVOBEE_SKIP_$group=1 to leave those tests out"
    command -v apt-get > /dev/null || fail "Something is missing and there is no apt-get: $by_hand"
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo > /dev/null || fail "Something is missing and there is no sudo: $by_hand"
        as_root=(sudo)
    fi
    echo "run.sh: installing $*"
    "${as_root[@]}" apt-get update -qq &&
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -qq --no-install-recommends "$@" > /dev/null ||
        fail "Installing $* failed: $by_hand"
}

wanted() {
    local skip="SERVOBEE_SKIP_$1"
    [ "${!skip:-}" != 1 ] && [ "$(uname -s)" = Linux ]
}

has_driver() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && return 0
    local folder
    for folder in /usr/share /usr/local/share /etc "${HOME:-/root}/.local/share"; do
        compgen -G "$folder/vulkan/icd.d/*.json" > /dev/null && return 0
    done
    return 1
}

has_browser() {
    [ -n "${SERVOBEE_BROWSER:-}" ] && return 0
    command -v chromium chromium-browser google-chrome > /dev/null
}

has_mpi() {
    command -v mpicc > /dev/null && command -v mpirun > /dev/null || return 1
    [ -n "${LIBCLANG_PATH:-}" ] || compgen -G '/usr/lib/llvm-*/lib/libclang*.so*' > /dev/null
}

# A Python of our own in the folder $2, with what the requirements in $3 name, for the tests that SERVOBEE_SKIP_$1=1 leaves out.
install_python() {
    local group=$1 tools=$2 requirements=$3
    cmp -s "$requirements" "$tools/installed.txt" && return 0
    python3 -c 'import venv, ensurepip' 2> /dev/null || install "$group" python3 python3-venv
    echo "run.sh: installing Python packages: $(tr '\n' ' ' < "$requirements")"
    python3 -m venv --clear "$tools" &&
        "$tools/bin/pip" install -q --no-compile --disable-pip-version-check -r "$requirements" ||
        fail "Installing Python packages failed: set SERVOBEE_SKIP_$group=1 to leave those tests out"
    cp "$requirements" "$tools/installed.txt"
}

command -v cargo > /dev/null || fail 'There is no cargo: install Rust with rustup'
command -v cc > /dev/null || fail 'There is no C compiler: install one (on Debian: apt-get install gcc libc6-dev)'
tools() {
    if wanted GPU && ! has_driver; then install GPU mesa-vulkan-drivers; fi
    if wanted BROWSER && ! has_browser; then install BROWSER chromium fonts-dejavu-core; fi
    if wanted FMU && [ -z "${SERVOBEE_PYTHON:-}" ]; then
        install_python FMU target/tools tests/export/requirements.txt
    fi
    if wanted PYTHON; then install_python PYTHON target/python python/tests/requirements.txt; fi
}

# What has to be fetched comes while the tests are compiled.
tools &
installing=$!
cargo test --release --locked --workspace --no-run "${tests[@]}" || { wait; fail 'The tests do not compile.'; }
wait "$installing" || fail 'What the tests need could not be installed: see above.'
if wanted FMU; then export SERVOBEE_PYTHON=${SERVOBEE_PYTHON:-$PWD/target/tools/bin/python}; fi

# Ranks: the program with the feature mpi, put aside before the others take its place.
if [ "${SERVOBEE_MPI:-}" = 1 ] && wanted MPI; then
    has_mpi || install MPI libopenmpi-dev openmpi-bin libclang-dev
    bash tests/mpi.sh
    export SERVOBEE_MPI_PROGRAM=$PWD/target/mpi/servobee
fi

# The Python package as a user installs it; it shares what is compiled. Much of it waits for processes: beside the other tests.
python_package() {
    CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target} target/python/bin/pip install -q --disable-pip-version-check \
        --force-reinstall --no-deps ./python &&
        target/python/bin/python -m pytest -q -rs python/tests ||
        { echo 'run.sh: the Python package does not install or fails its tests' >&2 && return 1; }
}
python_log=$(mktemp)
python_tests=
if [ "${#tests[@]}" -eq 0 ] && wanted PYTHON; then
    python_package > "$python_log" 2>&1 &
    python_tests=$!
fi

# What users run. With the whole workspace each time, so that all of it, the Python package too, has the same features of every
# crate and is compiled once. Each test binary prints what it skips; --no-fail-fast shows every failure at once.
# Many wait for programs that they have started: two tests for each core.
export RUST_TEST_THREADS=${RUST_TEST_THREADS:-$((2 * $(nproc 2> /dev/null || echo 2)))}
log=$(mktemp)
trap 'rm -f "$log" "$python_log"; [ -z "$python_tests" ] || kill "$python_tests" 2> /dev/null || true' EXIT
status=0
cargo test --release --locked --workspace --no-fail-fast "${tests[@]}" -- --show-output ${tests:+"${QUICK[@]/%/::}"} 2>&1 |
    tee "$log" || status=$?

summary() {
    echo
    grep -aE '^test result:' "$log" | awk '
        { passed += $4; failed += $6; ignored += $8 }
        END { printf "run.sh: %d passed, %d failed, %d ignored\n", passed, failed, ignored }' || true
    if grep -qaE '^(SKIPPED|NOT TESTED)' "$log"; then
        echo "run.sh: not everything was tested:"
        grep -aE '^(SKIPPED|NOT TESTED)' "$log" | sort -u
    fi
    [ "$status" -eq 0 ] || echo "run.sh: FAILED" >&2
    exit "$status"
}
if [ "${#tests[@]}" -gt 0 ]; then summary; fi

# A crate of somebody else's, and an example.
cargo build --release --locked --quiet --workspace --bins --examples || status=$?
built=${CARGO_TARGET_DIR:-target}/release
if [ "$("$built/outside" tests/data/bench.csv)" != delay ]; then
    echo 'run.sh: a crate that depends on servobee does not find the delay in tests/data/bench.csv' | tee -a "$log" >&2
    status=1
fi
if [ "$("$built/examples/own" tests/data/bench.csv target/own)" != delay ]; then
    echo 'run.sh: examples/own.rs does not find the delay in tests/data/bench.csv' | tee -a "$log" >&2
    status=1
fi
# It has the profile of this workspace; tests/soak.sh builds it in a folder of its own, with the compiler's.
if [ "$(sed -n '/^\[profile\.release/,/^$/p' Cargo.toml)" != $'[profile.release]\nlto = "off"' ]; then
    echo 'run.sh: crates that depend on servobee do not get its profile for release, which may only spare work' | tee -a "$log" >&2
    status=1
fi

if [ -n "$python_tests" ]; then
    wait "$python_tests" || status=1
    tee -a "$log" < "$python_log"
else
    echo 'SKIPPED: SERVOBEE_SKIP_PYTHON=1: the Python package was not tested' | tee -a "$log"
fi

# What is ready for a real GPU, with little work on the one that is here; and that it says what is missing.
if wanted GPU; then
    gpu=target/gpu
    { bash benches/gpu/pack.sh && bash benches/gpu/run.sh --small --out "$gpu/small"; } || {
        echo 'run.sh: benches/gpu/run.sh --small failed' | tee -a "$log" >&2
        status=1
    }
    if VK_DRIVER_FILES=none bash benches/gpu/run.sh --small --out "$gpu/small" 2> "$gpu/said" ||
        ! grep -q mesa-vulkan-drivers "$gpu/said"; then
        echo 'run.sh: benches/gpu/run.sh does not name the package of the driver that is missing' | tee -a "$log" >&2
        status=1
    fi
fi

# No file uses another that uses it.
if python3 -c 'import tomllib' 2> /dev/null; then
    python3 benches/house.py --circles || status=1
else
    echo 'NOT TESTED: circles between files: there is no Python 3.11' | tee -a "$log"
fi

# Licences and sources of what is linked; tests/soak.sh asks for advisories as well.
if cargo deny --version > /dev/null 2>&1; then
    cargo deny --offline --config .ci/deny.toml check licenses bans sources || status=1
else
    echo 'NOT TESTED: licences of what is linked: there is no cargo-deny (cargo install cargo-deny)' | tee -a "$log"
fi

summary
