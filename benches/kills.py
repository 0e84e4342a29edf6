"""Kills programs while they write (kill -9), goes on, and checks that what was finished is readable and that the end is, to the
byte, as if nobody had been killed:

    python benches/kills.py target/debug/endowire

30 data sets, 30 runs, 30 sweeps, 10 sessions, and with the Python package 10 logs of episodes (LeRobot). Times of
kills come from a fixed seed; how far a program is then depends on the machine. It takes some minutes, and ends with exit code 1 at
the first difference.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import random
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCENE = ROOT / "assets" / "scenes" / "curved_tube_exact.toml"
#: Elements that are fast enough to be killed often.
COARSE = {"method.element_mm": "4.0"}
DATASET = f"""
seed = 7
scenes = ["{SCENE}"]
devices = ["{ROOT}/assets/devices/wire_035_soft.toml"]
poses = 24
moments = 4
[view]
size_px = [96, 96]
bits = 8
"""
SWEEP = f"""
scene = "{SCENE}"
seed = 1
samples = 4
record = "shapes"
[set]
"method.element_mm" = 4.0
"script" = [{{ advance_mm = 120.0, step_mm = 4.0 }}]
[[axis]]
key = "vessel.wall.friction"
random = {{ from = 0.0, to = 0.3 }}
"""
#: Values of summary.json that tell how long something took, and in which folder.
ELSEWHERE = ("step_time_s", "wall_time_s", "scene_file")


def said(command: list[str], folder: Path) -> None:
    """Carries out a command to its end."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.stderr}")


def killed(command: list[str], folder: Path, after_s: float) -> bool:
    """Kills a command after a time; whether it was still going on."""
    going = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        going.wait(after_s)
        return False
    except subprocess.TimeoutExpired:
        going.send_signal(signal.SIGKILL)
        going.wait()
        return True


def content(path: Path) -> str:
    """What a file holds; of a summary, but for times and places."""
    if path.name == "summary.json":
        summary = json.loads(path.read_text())
        return json.dumps({key: value for key, value in summary.items() if key not in ELSEWHERE})
    return hashlib.sha256(path.read_bytes()).hexdigest()


def files(folder: Path) -> dict[str, str]:
    """The files of a folder, but for locks, journals and caches."""
    found = (path for path in sorted(folder.rglob("*")) if path.is_file())
    kept = (path for path in found if not path.name.endswith((".endowire-lock", ".jsonl")))
    return {str(path.relative_to(folder)): content(path) for path in kept}


def whole(folder: Path) -> int:
    """Reads whatever a kill has left under its own name, and counts it."""
    count = 0
    for path in folder.rglob("*"):
        if not path.is_file() or path.name.startswith("."):
            continue
        if path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".png":
            data = path.read_bytes()
            if not data.startswith(b"\x89PNG") or data[-8:-4] != b"IEND":
                sys.exit(f"{path}: is no whole picture")
        elif path.suffix == ".npz":
            with zipfile.ZipFile(path) as archive:
                if archive.testzip() is not None:
                    sys.exit(f"{path}: is damaged")
        count += 1
    return count


def check(what: str, command: list[str], folder: Path, tries: int, draw: random.Random, readable) -> None:
    """Kills a command `tries` times, each time in a folder of its own, up to three times there before it goes on to its end."""
    reference = folder / "reference"
    reference.mkdir()
    began = time.monotonic()
    said([part.replace("OUT", "out") for part in command], reference)
    took_s = time.monotonic() - began
    expected = files(reference / "out")
    kills = checked = 0
    for number in range(tries):
        place = folder / f"{number}"
        place.mkdir()
        for _ in range(1 + number % 3):
            if not killed(command, place, draw.uniform(0.02, 1.0) * took_s):
                break
            kills += 1
            checked += readable(place)
        said(command, place)
        found = files(place / "out")
        if found != expected:
            differing = {name for name in found.keys() | expected.keys() if found.get(name) != expected.get(name)}
            sys.exit(f"{what} {number}: {sorted(differing)} are not as without a kill")
    print(f"{what}: {tries} times, {kills} kills, {checked} files read after them, all with the same bytes in the end", flush=True)


LOG = """
import json, sys, gymnasium, endowire.gym
from endowire.gym.lerobot_log import LeRobotLog
log = LeRobotLog(gymnasium.make("endowire/CurvedTube-v0").unwrapped, sys.argv[1])
# Each episode by its own number, so that a log that goes on has those of one that was never left.
info = log.folder / "meta" / "info.json"
before = json.loads(info.read_text())["total_episodes"] if info.exists() else 0
for episode in range(before, 6):
    log.action_space.seed(episode)
    log.reset(seed=episode)
    for _ in range(15):
        *_, terminated, truncated, _ = log.step(log.action_space.sample())
        if terminated or truncated:
            break
log.close()
"""


def settings(keys: dict[str, str]) -> list[str]:
    """Keys of the scene, as options of a command."""
    return [part for key, value in keys.items() for part in ("--set", f"{key}={value}")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--python", help="a Python with the package, for logs of episodes")
    parser.add_argument("--tries", type=int, default=30)
    args = parser.parse_args()
    program, draw = str(args.program.resolve()), random.Random(1)
    with tempfile.TemporaryDirectory() as temporary:
        outer = Path(temporary)

        def place(name: str) -> Path:
            (outer / name).mkdir()
            return outer / name

        folder = place("runs")
        script = {"script": "[{ advance_mm = 120.0, step_mm = 0.4 }]"}
        pictures = {"view.views": '["fluoro"]', "view.every": "10", "view.size_px": "[64, 64]"}
        given = settings({**COARSE, **script, **pictures})
        run = [program, "run", str(SCENE), *given, "--out", "out", "--quiet", "--save-state", "state", "--resume", "state"]
        check("runs", run, folder, args.tries, draw, whole)

        folder = place("datasets")
        (outer / "set.toml").write_text(DATASET)
        check("data sets", [program, "dataset", "../../set.toml", "--out", "out", "--allow-unconverged"], folder, args.tries, draw, whole)

        folder = place("sweeps")
        (outer / "sweep.toml").write_text(SWEEP)
        sweep = [program, "sweep", "../../sweep.toml", "--out", "out", "--jobs", "2"]
        check("sweeps", sweep, folder, args.tries, draw, whole)

        folder = place("sessions")
        lines = [{"do": "move", "mm_per_s": 8.0, "deg_per_s": 0.0}] + [{"do": "wait", "ticks": 60}] * 300
        (outer / "inputs.jsonl").write_text("\n".join(json.dumps(line) for line in lines) + "\n")
        play = [program, "play", str(SCENE), *settings(COARSE), "--headless", "--inputs", "../../inputs.jsonl", "--record", "out/played.toml", "--size", "64"]
        check("sessions", play, folder, max(1, args.tries // 3), draw, whole)

        if args.python:
            folder = place("log")
            check("logs of episodes", [args.python, "-c", LOG, "out"], folder, max(1, args.tries // 3), draw, whole)


if __name__ == "__main__":
    main()
