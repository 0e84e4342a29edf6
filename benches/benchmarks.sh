#!/usr/bin/env bash
# Measures all methods on this machine and writes what was measured: BENCHMARKS.md and assets/pictures/compare.png.
# No figure in them is typed.
#
#     benches/benchmarks.sh [--quick] [FOLDER]      (FOLDER relative to the repository)
#
# FOLDER (out/benchmarks/COMMIT if absent) keeps what was measured; a second run goes on from there. --quick runs the smallest
# part of everything and writes FOLDER/BENCHMARKS.md instead, to see that all works.
set -euo pipefail
cd "$(dirname "$0")/.."
quick=
if [ "${1:-}" = --quick ]; then quick=1; shift; fi
commit=$(git rev-parse --short HEAD)
out=${1:-out/benchmarks/$commit}
# Changes that are not committed are measured too, so they must be told, and kept apart.
if ! git diff --quiet HEAD -- crates; then
  out=${1:-$out-$(git diff HEAD -- crates | git hash-object --stdin | cut -c1-8)}
  commit="$commit with changes"
fi
mkdir -p "$out"
# As it is published, optimised across crates.
cargo build --profile dist -p endowire-cli
endowire=target/dist/endowire
target=$out
compare=() timing=(--methods all --nodes 50,100,150,200,300,500,1000,2000 --limit-s 10) deformation=() navigation=()
if [ -n "$quick" ]; then
  compare=(--cases cantilever-1,soft-tube --methods kirchhoff,li2011-banded,discrete-rod --elements 8,16 --limit-s 2)
  timing=(--methods all --nodes 20,50 --repeats 3 --limit-s 0.5)
  deformation=(--l-mm 3 --l-over-h 3)
  navigation=(--targets aorta)
  picture=compare/compare.png
else
  compare=(--limit-s 15)
  target=. picture=assets/pictures/compare.png
fi
methods=$(realpath --relative-to="$target" docs/methods/README.md)

# A command, and what it says, kept once it has come to its end.
measure() {
  local name=$1; shift
  if [ -s "$out/$name.txt" ] && [ "$(cat "$out/$name.cmd")" = "endowire $*" ]; then return; fi
  rm -f "$out/$name.txt"
  echo "endowire $*" > "$out/$name.cmd"
  echo "measuring: $name" >&2
  "$endowire" "$@" > "$out/$name.part"
  mv "$out/$name.part" "$out/$name.txt"
}
# compare goes on by itself, cell by cell; its folder is no part of the command to repeat.
echo "endowire compare ${compare[*]}" > "$out/compare.cmd"
echo "measuring: compare" >&2
"$endowire" compare "${compare[@]}" --out "$out/compare" > "$out/compare.txt"
measure timing experiment timing "${timing[@]}"
measure deformation experiment deformation "${deformation[@]}"
measure navigation experiment navigation "${navigation[@]}"
measure loop experiment loop
[ -n "$quick" ] || cp "$out/compare/compare.png" "$picture"

processor=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -1)
origin="Written by \`benches/benchmarks.sh\` on $(date -u +%Y-%m-%d) from commit $commit, on ${processor:-an unknown processor}, $(nproc) cores, $(uname -s), $(rustc --version | cut -d' ' -f1,2)."
# What the program `ablation` has written stays.
parts=$(sed -n '/^## What each part brings/,$p' "$target/BENCHMARKS.md" 2>/dev/null || true)
block() {
  printf '## %s\n```sh\n' "$1"; cat "$out/$2.cmd"; printf '```\n```text\n'; cat "$out/$2.txt"; printf '```\n\n'
}
{
  printf '# Measured\n\n%s\nThe methods are described in [docs/methods](%s).\n\n' "$origin" "$methods"
  printf '![Error against time of every method, five scenes](%s)\n\n' "$picture"
  block "Error against time" compare
  block "Table 1 of Li et al. 2011, for every method" timing
  block "Table 2 of Li et al. 2011" deformation
  block "Navigation" navigation
  block "The loop" loop
  printf '%s' "${parts:+$parts
}"
} > "$target/BENCHMARKS.md"
