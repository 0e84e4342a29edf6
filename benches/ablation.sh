#!/usr/bin/env bash
# Takes the parts of the solver out one by one, or changes their constants (benches/ablation.tsv), and writes what becomes of
# insertions without them at the end of BENCHMARKS.md.
#
#     benches/ablation.sh [PATTERN]      (only parts whose line matches; prints the table and writes nothing)
#     benches/ablation.sh --check        (only that every line has something to change)
#
# Every part is built from a copy of the sources in target/ablation and run in turn with the whole; figures are ratios to the whole,
# times medians of REPEATS (1). What was measured is kept there, and a second run of the same commit goes on from it.
set -euo pipefail
cd "$(dirname "$0")/.."
parts() { grep -v -e '^#' -e '^$' benches/ablation.tsv; }
# A line that changes nothing is an error.
check() {
  while IFS=$'\t' read -r what file change; do
    if perl -pe "$change" "crates/core/src/$file" | cmp -s - "crates/core/src/$file"; then
      echo "benches/ablation.tsv: $what: $file has nothing to change" >&2
      exit 1
    fi
  done < <(parts)
}
check
if [ "${1:-}" = --check ]; then exit; fi
pattern=${1:-} repeats=${REPEATS:-1}
work=$PWD/target/ablation tree=$work/tree
commit=$(git rev-parse --short HEAD)
mkdir -p "$tree" "$work/$commit"
# As a build on the way: whole and parts are built alike.
export CARGO_TARGET_DIR=$work/build CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16
export CARGO_PROFILE_RELEASE_INCREMENTAL=true
build() {
  (cd "$tree" && cargo build -q --release -p endowire-benches --bin insertions --bin hard)
  mkdir -p "$1" && cp "$work/build/release/insertions" "$work/build/release/hard" "$1"
}
measure() { "$1/insertions" && "$1/hard" lines; }
git archive HEAD Cargo.toml Cargo.lock clippy.toml crates tests benches assets README.md | tar -x -C "$tree"
build "$work/whole"

rows=$work/$commit/rows.tsv
touch "$rows"
while IFS=$'\t' read -r what file change; do
  case "$what $file" in *"$pattern"*) ;; *) continue ;; esac
  if cut -f1 "$rows" | grep -qxF -- "$what"; then continue; fi
  source=$tree/crates/core/src/$file
  cp "$source" "$work/before"
  perl -pi -e "$change" "$source"
  build "$work/part"
  cp "$work/before" "$source"
  for ((k = 0; k < repeats; k++)); do
    measure "$work/whole" > "$work/whole.$k"
    measure "$work/part" > "$work/part.$k"
  done
  # Name, equilibria, iterations, last resorts, questions, median, whole: ratios of sums, and the median of the ratios of times.
  for ((k = 0; k < repeats; k++)); do
    paste "$work/whole.$k" "$work/part.$k"
  done | awk -F'\t' -v what="$what" -v scenes="$(wc -l < "$work/whole.0")" '
    { good[0] += $2; good[1] += $9; its[0] += $3; its[1] += $10; rest[0] += $4; rest[1] += $11
      asked[0] += $5; asked[1] += $12; whole += $7; part += $14
      if ($3 > 0) worst = $10 / $3 > worst ? $10 / $3 : worst
      if (NR % scenes == 0) { ratios[NR / scenes] = part / whole; whole = part = 0 } }
    END { repeats = NR / scenes
      for (i = 2; i <= repeats; i++)
        for (j = i; j > 1 && ratios[j] < ratios[j - 1]; j--) { t = ratios[j]; ratios[j] = ratios[j - 1]; ratios[j - 1] = t }
      printf "%s\t%.2f\t%.2f\t%.2f\t%.2f\t%+d\t%+d\n", what, its[1] / its[0], worst, asked[1] / asked[0],
        ratios[int((repeats + 1) / 2)], (good[1] - good[0]) / repeats, (rest[1] - rest[0]) / repeats }' >> "$rows"
  tail -1 "$rows" >&2
done < <(parts)

table() {
  echo '| without, or changed | iterations | largest of a scene | questions | time | equilibria | last resorts |'
  echo '|---|---|---|---|---|---|---|'
  sed 's/\t/ | /g; s/^/| /; s/$/ |/' "$rows"
}
if [ -n "$pattern" ]; then table; exit; fi
sed -i '/^## What each part brings$/,$d' BENCHMARKS.md
{
  printf '## What each part brings\nWritten by `benches/ablation.sh` from commit %s: seven insertions (`benches/src/bin/insertions.rs`) and the scenes of `benches/hard` ' "$commit"
  printf 'without a part of the solver, or with another constant, over those with it. '
  printf 'Ratios of Newton iterations, of questions to the hierarchy and of time (median of %s pairs); how many more commands ended in an ' "$repeats"
  printf 'equilibrium, and in the last resort.\n\n'
  table
} >> BENCHMARKS.md
