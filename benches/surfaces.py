"""How insertions end on the surfaces of a folder: a wire goes from the inlet towards the farthest opening of each.

    python benches/surfaces.py target/release/endowire FOLDER [FOLDER …]

Nothing is fetched. For each surface `vessel check`, `vessel centreline`, `vessel passable` and `run` are asked. An end is strict if
the wire reached its length or left the vessel in equilibrium, or was blocked where the centre line is narrower than the wire, or
where no way leads to any other opening. Files that `check` refuses are named and not counted. Prints a line for each surface, the kinds of all other ends, and the share of strict ends; ends with 1 below `--least`.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

DEVICES = Path(__file__).resolve().parent.parent / "assets" / "devices"
KINDS = {".stl", ".obj", ".ply", ".vtp", ".vtk"}
# A 0.035" wire where the inlet has at least this radius, else one of 0.014".
WIDE_MM = 4.0
# How far beyond the way to the farthest opening the wire is pushed.
BEYOND_MM = 10.0
# Openings that are asked for the farthest one.
MOST_OPENINGS = 8
# Largest radius of the lumen that blocks a wire, in radii of the wire: the wall that is felt is smoothed.
NARROW = 1.1


class Refused(Exception):
    """A command that ended with an error, in the words of its last line."""


def asked(program: str, arguments: list[str], seconds: float) -> str:
    """Standard output of a command."""
    try:
        done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise Refused(f"{arguments[0]}: more than {seconds:.0f} s") from None
    if done.returncode != 0:
        raise Refused((done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1])
    return done.stdout


def farthest(program: str, surface: Path, openings: list[int], device: Path, seconds: float) -> dict:
    """What `passable` says about the longest way."""
    ways, refused = [], Refused("no way leads to an opening")
    for number in openings[:MOST_OPENINGS]:
        way = ["vessel", "passable", str(surface), "--device", str(device), "--to", str(number), "--json"]
        try:
            ways.append(json.loads(asked(program, way, seconds)))
        except Refused as error:
            refused = error
    if not ways:
        raise refused
    return max(ways, key=lambda way: way["length_mm"])


def end_of(program: str, surface: Path, report: dict, folder: Path, seconds: float) -> tuple[bool, str]:
    """Whether an insertion ended as it should, and how."""
    openings = report["openings"]
    length_mm = max(high - low for low, high in zip(report["low_mm"], report["high_mm"]))
    is_wide = report["inlet"] is not None and openings[report["inlet"]]["radius_mm"] >= WIDE_MM
    device = DEVICES / f"{'wire_035_standard' if is_wide else 'microwire_014'}.toml"
    if len(openings) >= 2:
        inlet = report["inlet"]
        sheath = f"opening = {inlet}"
        try:
            asked(program, ["vessel", "centreline", str(surface), "--out", str(folder / "line.csv")], seconds)
            others = [opening["index"] for opening in openings if opening["index"] != inlet]
            way = farthest(program, surface, others, device, seconds)
            length_mm = way["length_mm"] + BEYOND_MM
        except Refused as error:
            if "no way leads" not in str(error):
                raise
            way = None
    elif report["start"] is not None:
        # A vessel with one opening or none has no other end: the wire goes in from the offered place.
        way = {"narrowest": {"device_radius_mm": 0.0}}
        sheath = f"position_mm = {report['start']['position_mm']}\ndirection = {report['start']['direction']}"
    else:
        return False, f"{len(openings)} openings and no place inside"
    scene, out = folder / "scene.toml", folder / "out"
    scene.write_text(
        f"[vessel]\nfile = {json.dumps(str(surface.resolve()))}\n[device]\nfile = {json.dumps(str(device))}\n"
        f"[sheath]\n{sheath}\n[[script]]\nadvance_mm = {length_mm:.3f}\nstep_mm = 2.0\n"
    )
    try:
        asked(program, ["run", str(scene), "--out", str(out), "--force"], seconds)
    except Refused as error:
        summary = out / "summary.json"
        inserted_mm = json.loads(summary.read_text())["inserted_mm"] if summary.exists() else 0.0
        at = re.search(r"blocked at \[(.*?)\]", str(error))
        if "has left the vessel through opening" in str(error):
            return True, f"left the vessel after {inserted_mm:.0f} mm"
        if at and way is None:
            return True, f"blocked at {inserted_mm:.0f} mm: no way leads to any other opening"
        if at and is_narrow(folder / "line.csv", [float(mm) for mm in at[1].split(",")], way["narrowest"]["device_radius_mm"]):
            return True, f"blocked at {inserted_mm:.0f} mm, where the lumen is narrower than the wire"
        return False, f"{kind_of(str(error))} (at {inserted_mm:.0f} of {length_mm:.0f} mm)"
    summary = json.loads((out / "summary.json").read_text())
    if not summary["converged"]:
        return False, f"{summary['unconverged_steps']} steps without equilibrium"
    through = summary["left_through"]
    return True, f"inserted {summary['inserted_mm']:.0f} mm" + (f", left through opening {through}" if through is not None else "")


def is_narrow(line: Path, place_mm: list[float], radius_mm: float) -> bool:
    """Whether the centre line is narrower than a wire at its point nearest to a place."""
    if not line.exists():
        return False
    rows = [[float(value) for value in row.split(",")[:4]] for row in line.read_text().splitlines() if row[:1] in "-0123456789"]
    nearest = min(rows, key=lambda row: math.dist(row[:3], place_mm))
    return nearest[3] <= NARROW * radius_mm


def kind_of(error: str) -> str:
    """An error without its file and its remedy."""
    return re.sub(r"^(endowire: |\S*/\S+: )*", "", error).split("; ")[0][:160]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", help="the program endowire")
    parser.add_argument("folder", nargs="+", type=Path, help="folders with surfaces, or surfaces")
    parser.add_argument("--least", type=float, default=0.98, help="least share of strict ends (0.98)")
    parser.add_argument("--seconds", type=float, default=600.0, help="longest time of a command (600)")
    args = parser.parse_args()
    found = [path for folder in args.folder for path in ([folder] if folder.is_file() else sorted(folder.rglob("*")))]
    surfaces = [path for path in found if path.suffix.lower() in KINDS]
    strict, counted, kinds = 0, 0, Counter()
    for surface in surfaces:
        try:
            report = json.loads(asked(args.program, ["vessel", "check", str(surface), "--json"], args.seconds))
        except Refused as error:
            print(f"refused {surface}: {kind_of(str(error))}", flush=True)
            continue
        counted += 1
        with tempfile.TemporaryDirectory() as folder:
            try:
                is_strict, how = end_of(args.program, surface, report, Path(folder), args.seconds)
            except Refused as error:
                is_strict, how = False, kind_of(str(error))
        strict += is_strict
        if not is_strict:
            kinds[how.split(" (at ")[0]] += 1
        print(f"{'strict ' if is_strict else 'NOT    '} {surface}: {how}", flush=True)
    for how, count in kinds.most_common():
        print(f"{count:4} {how}")
    share = strict / max(counted, 1)
    print(f"{strict} of {counted} ends are strict ({100 * share:.0f} %)")
    return 0 if counted and share >= args.least else 1


if __name__ == "__main__":
    sys.exit(main())
