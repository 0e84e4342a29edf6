"""How exactly fits find stiffness, friction and the entry's pose again, how often their intervals cover the truth, and what a fit of three
nested tubes costs beside one by differences.

    RAYON_NUM_THREADS=1 python crates/python/benches/fits.py wire fits.jsonl --repeats 100     # seconds each; goes on where it ended
    RAYON_NUM_THREADS=1 python crates/python/benches/fits.py tubes

A hooked wire in a bent tube is pushed, turned and pulled back; 12 places on it are seen after every other command with a noise of
0.2 mm, and the push force with 2 mN. Each repeat is the same recording with other noise, fitted from values that are off by 10 to 30 %.
The tubes are those of Dupont's kind, turned and pushed inside one another without friction; their tip is seen with 0.2 mm.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

import endowire
from endowire import Observed

SIGMA_MM, SIGMA_N = 0.2, 2e-3
FREE = ["EI[0]", "EI[1]", "friction", "entry_x", "entry_y", "direction_x", "direction_y"]
START = {"EI[0]": 0.8, "EI[1]": 1.3, "friction": 0.7}
PUSHES, PULLS = 45, 15


def commands():
    turns = 0.15 * np.sin(0.7 * np.arange(PUSHES + PULLS))
    advances = np.append(np.full(PUSHES, 2.0), np.full(PULLS, -2.0))
    return np.stack([advances, turns], axis=1)[:, None, :]


def wire_in_tube(tip_nmm2=6.0, shaft_nmm2=14.0):
    tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": tip_nmm2, "rest_curvature_per_mm": [0.06, 0.0]}
    shaft = {"length_mm": 300.0, "radius_mm": 0.2, "bending_stiffness_nmm2": shaft_nmm2}
    method = {"name": "kirchhoff", "element_mm": 4.0, "tolerance": 1e-8}
    vessel = endowire.Vessel.generate("curved_tube")
    return endowire.Simulation(vessel, endowire.Instrument([tip, shaft]), method=method, wall={"friction": 0.15})


def recording(truth, moves):
    """What is seen without noise."""
    clean = []
    for k, gradient in enumerate(truth.gradients(moves, by=["EI[0]"])):
        if k % 2 == 0:
            continue
        from_tip_mm = np.linspace(0.0, 0.95 * gradient.from_tip_mm[0], 12)
        points = Observed(k, "points", np.zeros(36), SIGMA_MM, from_tip_mm=from_tip_mm)
        force = Observed(k, "push_force", np.zeros(1), SIGMA_N)
        for one in (points, force):
            one.value = one.residual(gradient)[0] * one.sigma
            clean.append(one)
    return clean


def fitted(repeat, start, moves, clean):
    """One repeat, as a line of the file: its number, values, standard deviations, seconds; or why there are none."""
    rng = np.random.default_rng([0, repeat])
    noisy = [
        Observed(one.after, one.of, one.value + one.sigma * rng.standard_normal(np.shape(one.value)), one.sigma, one.from_tip_mm)
        for one in clean
    ]
    began = time.process_time()
    try:
        fit = endowire.fit(start, moves, noisy, FREE)
    except endowire.ComputationError as error:
        return {"repeat": repeat, "failed": str(error), "s": time.process_time() - began}
    line = {"repeat": repeat, "values": fit.values.tolist(), "sigma": fit.sigma.tolist(), "s": time.process_time() - began}
    return line if fit.converged else line | {"failed": "not converged"}


def wire(file, repeats):
    truth, moves = wire_in_tube(), commands()
    true = np.array([truth.value(name) for name in FREE])
    start = truth.changed({name: factor * truth.value(name) for name, factor in START.items()})
    clean = recording(truth, moves)
    lines = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {line["repeat"] for line in lines}
    with file.open("a") as to:
        for repeat in sorted(set(range(repeats)) - done):
            lines.append(fitted(repeat, start, moves, clean))
            print(json.dumps(lines[-1]), file=to, flush=True)
    whole = [line for line in lines if "failed" not in line]
    off, sigmas = np.array([line["values"] for line in whole]) - true, np.array([line["sigma"] for line in whole])
    covered = np.abs(off) <= 1.96 * sigmas
    print(f"{len(whole)} fits, {len(lines) - len(whole)} failed, {np.median([line['s'] for line in lines]):.1f} s each (median)")
    for k, name in enumerate(FREE):
        scale = abs(true[k]) if name in START else 1.0
        unit = " of itself" if name in START else ""
        print(
            f"{name:12} root mean square error {np.sqrt(np.mean(off[:, k] ** 2)) / scale:.2e}{unit}, "
            f"standard deviation as told {np.median(sigmas[:, k]) / scale:.2e}, interval covers {covered[:, k].mean():.0%}"
        )


#: Of three tubes, innermost first: length of the straight end and of the curved tip, mm, curvature, 1/mm, EI, N mm2.
TUBES = [(184.0, 86.0, 1 / 55, 2000.0), (17.0, 150.0, 1 / 265, 7000.0), (0.0, 150.0, 1 / 265, 7000.0)]
OF_TUBES = [f"tube {k}.{name}[0]" for k in (3, 2, 1) for name in ("EI", "GJ", "rest_u")]


def nested_tubes():
    """In a tube of 150 mm radius, whose wall nothing touches."""

    def tube(k, straight_mm, curved_mm, per_mm, nmm2):
        section = {"bending_stiffness_nmm2": nmm2, "torsional_stiffness_nmm2": nmm2 / 1.3}
        section |= {"radius_mm": 0.5 + 0.4 * k, "inner_radius_mm": 0.3 + 0.4 * k}
        curved = section | {"length_mm": curved_mm, "rest_curvature_per_mm": [per_mm, 0.0]}
        return endowire.Instrument([curved, section | {"length_mm": straight_mm + 400.0 * (3 - k)}])

    count, z_mm = 24, np.arange(-20.0, 381.0, 40.0)
    angles = 2 * np.pi * np.arange(count) / count
    ring = 150.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corners = np.concatenate([np.column_stack([ring, np.full(count, z)]) for z in z_mm])
    k = np.arange(count)
    one = np.concatenate([np.stack([k, (k + 1) % count, k + count], 1), np.stack([(k + 1) % count, (k + 1) % count + count, k + count], 1)])
    triangles = np.concatenate([one + count * row for row in range(len(z_mm) - 1)])
    vessel = endowire.Vessel.from_arrays(corners, triangles)
    return endowire.Simulation(
        vessel,
        [tube(k, *numbers) for k, numbers in enumerate(TUBES)],
        names=["tube 3", "tube 2", "tube 1"],
        position_mm=[0.0, 0.0, 0.0],
        direction=[0.0, 0.0, 1.0],
        method={"name": "kirchhoff", "element_mm": 8.0, "tolerance": 1e-9},
    )


def tubes():
    truth, rng = nested_tubes(), np.random.default_rng(0)
    truth.run(np.tile([[8.0, 0.0], [5.0, 0.0], [3.0, 0.0]], (12, 1, 1)))
    advances, turns = rng.uniform([-1, -1, -1], [3, 3, 3], (40, 3)), rng.uniform(-0.3, 0.3, (40, 3))
    moves = np.stack([advances, turns], axis=2)
    tips = [state.positions_mm[-1] for state in truth.recorded(moves).gradients(by=[])]
    observed = [Observed(k, "tip", tip + 0.2 * rng.standard_normal(3), 0.2) for k, tip in enumerate(tips)]
    start = truth.changed({name: (1.1 if "EI" in name else 1.05) * truth.value(name) for name in OF_TUBES})
    began = time.process_time()
    fit = endowire.fit(start, moves, observed, OF_TUBES)
    fit_s = time.process_time() - began
    print(fit)
    began = time.process_time()
    for name in OF_TUBES:
        for by in (-1e-4, 1e-4):
            start.changed({name: (1.0 + by) * start.value(name)}).run(moves)
    differences_s = time.process_time() - began
    began = time.process_time()
    start.recorded(moves).gradients(by=OF_TUBES)
    gradients_s = time.process_time() - began
    print(f"the fit {fit_s:.2f} s in {fit.iterations} iterations; one matrix of derivatives {gradients_s:.3f} s, by differences {differences_s:.3f} s")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = arguments.add_subparsers(dest="kind", required=True)
    of_wire = kinds.add_parser("wire")
    of_wire.add_argument("file", type=Path, help="one line for each repeat; what is in it is not repeated")
    of_wire.add_argument("--repeats", type=int, default=100)
    kinds.add_parser("tubes")
    given = arguments.parse_args()
    if given.kind == "wire":
        wire(given.file, given.repeats)
    else:
        tubes()


if __name__ == "__main__":
    main()
