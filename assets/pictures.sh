#!/usr/bin/env bash
# Draws the pictures of README.md and of chapters 0, 1, 5 and 15 of the guide anew, in assets/pictures; a test runs it and compares
# (crates/cli/tests/cli/pictures.rs). That of chapter 16 is a curve of learning:
# `python crates/python/examples/learn_arch.py plot out/learn --picture assets/pictures/learning.png`. That of the page is a browser's, 1280 × 800, after
# its first scene's script with the beam on.
#
#     assets/pictures.sh                      with a program that is built
#     assets/pictures.sh ENDOWIRE FOLDER      with that program, into that folder: all but the poses, which an example draws
set -euo pipefail
cd "$(dirname "$0")/.."
endowire=${1:-}
to=${2:-assets/pictures}
if [ -z "$endowire" ]; then
  cargo build --release -p endowire-cli
  endowire=${CARGO_TARGET_DIR:-target}/release/endowire
fi
endowire=$(realpath "$endowire")
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# A body at rest, also in the middle of a breath.
rests=(--set view.patient.torso.breath_mm=0 --set view.patient.torso.beat_mm=0)

# Eight poses of each part of the body.
if [ $# -eq 0 ]; then
  cargo run --release -p endowire-viewer --example poses -- "$to" 192
fi

# README.md and chapter 0: the window after what that chapter has hands do.
sed -n '/^```json file=hand.jsonl$/,/^```$/p' docs/guide/0-first-five-minutes.md | sed '/^```/d' >"$out/hand.jsonl"
scene=$PWD/assets/scenes/arch_carotid.toml
(cd "$out" && "$endowire" play "$scene" --headless "${rests[@]}" --inputs hand.jsonl --record played.toml >/dev/null)
cp "$out/play.png" "$to"

# Chapter 1: the way of a catheter.
"$endowire" vessel passable assets/vessels/hepatic.stl --centreline assets/vessels/hepatic.csv --device assets/devices/catheter_4f_vertebral.toml \
  --to "right hepatic" --picture "$to"/passable.png >/dev/null

# README.md: the last frames of a run.
"$endowire" run assets/scenes/aortic_arch.toml "${rests[@]}" --out "$out/arch" --quiet
for view in 3d fluoro; do
  cp "$(ls "$out"/arch/frames/step_*_$view.png | tail -n 1)" "$to"/aortic_arch_$view.png
done

# Modes, two planes, a C-arm that turns: the arch after the script of its scene.
draw() { # NAME OF THE FOLDER, OPTIONS
  "$endowire" fluoro assets/scenes/arch_angiography.toml --out "$out/$1" "${@:2}"
}
draw live "${rests[@]}" --size 320 --mode fluoro --set 'view.injection=[]' --time 0 --count 8 --hold
cp "$out/live/frame_000007_fluoro.png" "$to"/arch_fluoro.png
cp "$out/live/hold.png" "$to"/arch_hold.png
draw cine "${rests[@]}" --size 320 --mode cine --time 1.6
cp "$out/cine/frame_000000_fluoro.png" "$to"/arch_cine.png
draw dsa --size 320 --mode dsa --time 1.6
cp "$out/dsa/frame_000000_fluoro.png" "$to"/arch_dsa.png
draw roadmap --size 320 --mode roadmap
cp "$out/roadmap/frame_000000_fluoro.png" "$to"/arch_roadmap.png
draw pair "${rests[@]}" --size 320 --mode cine --time 1.6 --pose "RAO 30" --biplane 90
cp "$out/pair/frame_000000_fluoro.png" "$to"/arch_pair_a.png
cp "$out/pair/frame_000000_fluoro_b.png" "$to"/arch_pair_b.png
draw turn --size 200 --mode dsa --time 1.4 --pose "RAO 60" --turn 120 --count 4
for k in 0 1 2 3; do
  cp "$out/turn/frame_00000${k}_fluoro.png" "$to"/arch_turn_$k.png
done

# Chapter 15, what was mended: a thin wire, two coaxial instruments, contrast medium in the liver, skin and air, blades.
mended() { # NAME, FILE OF IT, SCENE, OPTIONS
  "$endowire" fluoro "$3" --out "$out/mended_$1" --size 200 "${@:4}"
  cp "$out/mended_$1/frame_000000_$2.png" "$to/mended_$1.png"
}
cat >"$out/wire_014.toml" <<END
vessel.file = "$PWD/assets/vessels/curved_tube.stl"
device.file = "$PWD/assets/devices/microwire_014.toml"
sheath = { position_mm = [0.0, 0.0, 1.0], direction = [0.0, 0.0, 1.0] }
method = { name = "kirchhoff", element_mm = 4.0 }
script = [{ advance_mm = 150.0, step_mm = 10.0 }]
[view]
views = ["fluoro"]
c_arm = { field_mm = 300.0, isocentre_mm = [0.0, 0.0, 70.0] }
xray = { tissue_mm = 150.0 }
detector = { dose_ngy = 300.0 }
END
mended wire fluoro "$out/wire_014.toml"
catheter=(assets/scenes/arch_vertebral.toml --steps 90 --set c_arm.magnification=2.5)
mended coaxial fluoro "${catheter[@]}" --labels
for k in 1 2; do
  cp "$out/mended_coaxial/frame_000000_mask_$k.png" "$to"/mended_coaxial_$k.png
done
sed -n '/^```toml file=liver.toml$/,/^```$/p' docs/guide/15-pictures.md | sed '/^```/d' | sed "s#\"assets/#\"$PWD/assets/#" >"$out/liver.toml"
mended liver fluoro "$out/liver.toml" --steps 0 --time 2.0
body=(assets/scenes/aortic_arch.toml --steps 0 --pose "RAO 20" --set c_arm.field_mm=540)
mended skin fluoro "${body[@]}"
mended blades fluoro "${body[@]}" --set 'c_arm.collimation_mm=[270, 297]'

# Chapter 15, pairs: one picture with and without something.
pair() { # NAME, SCENE, OPTIONS
  "$endowire" fluoro "$2" --out "$out/pair_$1" --size 200 "${@:3}"
  cp "$out/pair_$1/frame_000000_fluoro.png" "$to/pair_$1.png"
}
"$endowire" vessel from-labels assets/ct/abdomen_labels.nii.gz --label 52 --label 65 --label 66 --out "$out/aorta.stl" >/dev/null
cat >"$out/abdomen.toml" <<END
vessel.file = "$out/aorta.stl"
device.file = "$PWD/assets/devices/wire_035_hydrophilic_angled.toml"
sheath.opening = 1
script = [{ advance_mm = 150.0, step_mm = 5.0 }]
[view]
views = ["fluoro"]
c_arm = { pose = "AP", field_mm = 340.0 }
END
pair generated "$out/abdomen.toml" --set 'patient.torso={"diaphragm_mm":150,"breath_mm":0,"beat_mm":0}'
pair tomogram "$out/abdomen.toml" --set "patient.ct={\"file\":\"$PWD/assets/ct/abdomen.nii.gz\"}"
chest=(assets/scenes/arch_carotid.toml --steps 0 "${rests[@]}" --set c_arm.field_mm=300)
pair 30_ngy "${chest[@]}"
pair 300_ngy "${chest[@]}" --mode cine
pair no_scatter "${chest[@]}" --mode cine --set detector.scatter_fraction=0
pair scatter "${chest[@]}" --mode cine --set detector.scatter_fraction=0.5
pair shaded "${chest[@]}" --mode cine --set xray.harmonised=0
pair edges "${chest[@]}" --mode cine --set xray.edges=1
