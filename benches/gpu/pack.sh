#!/usr/bin/env bash
# Builds what run.sh needs and puts it into target/gpu, to be carried to a machine with a GPU and nothing else:
#   benches/gpu/pack.sh [PROFILE]     release, unless something else is named
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

profile=${1:-release}
kit=target/gpu
rm -rf "$kit/bin"
mkdir -p "$kit/bin" "$kit/debs"

# The executables of one build, so that it is one set of features, that of tests/run.sh.
built=$(cargo build --locked --workspace --profile "$profile" --bin servobee --bench gpu --test all --message-format=json |
    grep -o '"executable":"[^"]*"' | cut -d '"' -f 4)
for name in servobee gpu all; do
    program=$(grep -E "/$name(-[0-9a-f]+)?$" <<< "$built")
    cp "$program" "$kit/bin/${name/#all/tests}"
    # Without the tables for a debugger, which weigh more than the program.
    if command -v strip > /dev/null; then strip "$kit/bin/${name/#all/tests}"; fi
done
cp benches/gpu/run.sh benches/gpu/row.cu benches/gpu/jax_rows.py tests/data/bench.csv "$kit/"
git describe --always --dirty > "$kit/commit" 2> /dev/null || echo unknown > "$kit/commit"

# Vulkan's loader and what NVIDIA's driver links, for a machine that has neither.
if command -v apt-get > /dev/null && ! compgen -G "$kit/debs/*.deb" > /dev/null; then
    packages=(libvulkan1 libegl1 libglvnd0 libopengl0 libgl1 libglx0 libgles2 libx11-6 libxext6 libxcb1 libxau6 libxdmcp6
        libbsd0 libmd0)
    (cd "$kit/debs" && apt-get download -qq "${packages[@]}" > /dev/null 2>&1) ||
        echo 'pack.sh: the packages of the Vulkan loader could not be downloaded; the machine has to have them' >&2
fi
du -sh "$kit"
