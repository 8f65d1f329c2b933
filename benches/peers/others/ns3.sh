#!/bin/sh
# `ns3.sh mesh|queues ARGUMENT ...`: compiles `ns3_mesh.cc` or `ns3_queues.cc` against the ns-3 that is installed, once, and runs it with the
# arguments. Status 77 where ns-3 is not installed.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
name="ns3_$1"
shift
modules="ns3-core ns3-network ns3-internet ns3-point-to-point ns3-traffic-control"
# shellcheck disable=SC2086 # words
if ! command -v g++ >/dev/null || ! command -v pkg-config >/dev/null || ! pkg-config --exists $modules; then
    echo "ns-3 is not installed: apt-get install g++ pkg-config libns3-dev" >&2
    exit 77
fi
build="${CARGO_TARGET_DIR:-$here/../target}/others"
program="$build/$name"
mkdir -p "$build"
if [ ! "$program" -nt "$here/$name.cc" ]; then
    # No contraction of products and sums: the same bits as everywhere else. Debian's lists of libraries name some that its packages do not need.
    libraries=$(for module in $modules; do printf ' -l%s' "$module"; done)
    # shellcheck disable=SC2046,SC2086 # words
    g++ -std=c++17 -O3 -DNDEBUG -ffp-contract=off "-DNS3_VERSION=\"$(pkg-config --modversion ns3-core)\"" -o "$program.$$" "$here/$name.cc" \
        -L"$(pkg-config --variable=libdir ns3-core)" $libraries >&2
    # Renamed as a whole: another process, such as a second test, may find the program missing or old at the same time, and must not run half of it.
    mv "$program.$$" "$program"
fi
exec "$program" "$@"
