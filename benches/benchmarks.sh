#!/usr/bin/env bash
# Writes BENCHMARKS.md and assets/pictures/compare.png from measurements on this machine: no figure in it is typed.
# A folder as argument keeps what was measured; a second run goes on from there.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-out/benchmarks}
mkdir -p "$out"
cargo build --release --quiet
endowire=target/release/endowire
"$endowire" compare --out "$out/compare" > "$out/compare.txt"
"$endowire" experiment timing --methods all --nodes 50,100,150,200,300,500,1000,2000 --limit-s 2 > "$out/timing.txt"
"$endowire" experiment deformation > "$out/deformation.txt"
"$endowire" experiment navigation > "$out/navigation.txt"
cp "$out/compare/compare.png" assets/pictures/compare.png

processor=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -1)
block() { printf '```sh\n%s\n```\n```text\n' "$1"; cat "$2"; printf '```\n\n'; }
{
  echo "# Measured"
  echo
  echo "Written by \`benches/benchmarks.sh\` on $(date -u +%Y-%m-%d) from commit $(git rev-parse --short HEAD), on ${processor:-an unknown processor}, $(nproc) cores, $(rustc --version | cut -d' ' -f1,2)."
  echo "The methods are described in [docs/methods](docs/methods/README.md)."
  echo
  echo "## Error against time"
  echo "![Error against time of every method, five scenes](assets/pictures/compare.png)"
  echo
  block "endowire compare" "$out/compare.txt"
  echo "## Table 1 of Li et al. 2011, for every method"
  block "endowire experiment timing --methods all --nodes 50,100,150,200,300,500,1000,2000 --limit-s 2" "$out/timing.txt"
  echo "## Table 2 of Li et al. 2011"
  block "endowire experiment deformation" "$out/deformation.txt"
  echo "## Navigation"
  block "endowire experiment navigation" "$out/navigation.txt"
} > BENCHMARKS.md
