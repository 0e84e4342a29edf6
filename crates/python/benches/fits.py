"""How exactly fits find stiffness, friction and the entry's pose again, and how often their intervals cover the truth.

    RAYON_NUM_THREADS=1 python crates/python/benches/fits.py --repeats 100          # minutes

A hooked wire in a bent tube is pushed, turned and pulled back; 12 places on it are seen after every other command with a noise of
0.2 mm, and the push force with 2 mN. Each repeat is the same recording with other noise, fitted from values that are off by 10 to 30 %.
"""

import argparse
import time

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


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--repeats", type=int, default=100)
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args()
    truth, moves, rng = wire_in_tube(), commands(), np.random.default_rng(given.seed)
    true = np.array([truth.value(name) for name in FREE])
    start = truth.changed({name: factor * truth.value(name) for name, factor in START.items()})
    clean = recording(truth, moves)
    found, sigmas, seconds, failed = [], [], [], 0
    for repeat in range(given.repeats):
        noisy = [
            Observed(one.after, one.of, one.value + one.sigma * rng.standard_normal(np.shape(one.value)), one.sigma, one.from_tip_mm)
            for one in clean
        ]
        began = time.process_time()
        try:
            fit = endowire.fit(start, moves, noisy, FREE)
        except endowire.ComputationError as error:
            failed += 1
            print(f"{repeat}: {error}", flush=True)
            continue
        seconds.append(time.process_time() - began)
        if not fit.converged:
            failed += 1
            print(f"{repeat}: not converged", flush=True)
            continue
        found.append(fit.values)
        sigmas.append(fit.sigma)
    off, sigmas = np.array(found) - true, np.array(sigmas)
    covered = np.abs(off) <= 1.96 * sigmas
    print(f"{len(found)} fits, {failed} failed, {np.median(seconds):.1f} s each (median)")
    for k, name in enumerate(FREE):
        scale = abs(true[k]) if name in START else 1.0
        unit = " of itself" if name in START else ""
        print(
            f"{name:12} root mean square error {np.sqrt(np.mean(off[:, k] ** 2)) / scale:.2e}{unit}, "
            f"standard deviation as told {np.median(sigmas[:, k]) / scale:.2e}, interval covers {covered[:, k].mean():.0%}"
        )


if __name__ == "__main__":
    main()
