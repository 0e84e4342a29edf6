"""The table of README.md: `python figures.py [solver …]`, by default endowire and the solvers of cosseratbench that are installed.

Experiments run one after another in this process, each at its own number of elements; endowire also at a quarter and at four
times as many. Times are processor time of the run that cosseratbench times, which other programs on the machine change less.
"""

from __future__ import annotations

import itertools
import sys
import time
from dataclasses import replace

import numpy as np
from cosseratbench import registry
from cosseratbench.experiment import Experiment, Result, run, score
from cosseratbench.experiments import twist
from cosseratbench.scenario import Material, Scenario
from cosseratbench.trajectory import Trajectory
from endowire_cosseratbench import Rods

STATIC = ("cantilever", "catenary", "crossing")
MOVING = ("twist", "pendulum", "capstan", "pile")
#: Largest error of the twist at which a rod buckles, as a part of the ramp to the twist.
RESOLVED = 1e-5


def timed(experiment: Experiment, name: str, n_elements: int) -> tuple[Result, float]:
    """A result, and the processor time in s of its run after the warm-up."""
    solver, spent = registry.load_solver(name), [0.0]
    solve = solver.run

    def clocked(*args, **options):
        begin = time.process_time()
        try:
            return solve(*args, **options)
        finally:
            spent.append(time.process_time() - begin)

    solver.run = clocked
    return run(experiment, solver, n_elements=n_elements), spent[-1]


def row(experiment: str, solver: str, n_elements: int, numbers: dict[str, float], rest: str = "") -> str:
    told = ", ".join(f"{key} {value:.1e}" for key, value in numbers.items() if key != "settling_residual")
    return f"| {experiment} | {solver} | {n_elements} | {told} | {rest} |"


def reference(experiment: Experiment) -> dict[str, float]:
    """What the bench's own reference would score, were it a solver's result: the least that can be told by its metrics."""
    places, ends = np.linspace(0.0, 1.0, experiment.n_elements + 1), []
    for curve in experiment.reference(experiment.scenario):
        along = np.linspace(0.0, 1.0, len(curve))
        ends.append(np.stack([np.interp(places, along, curve[:, i]) for i in range(3)], axis=1))
    still = [np.stack([end, end]) for end in ends]
    directors = [np.zeros((2, experiment.n_elements, 3)) for _ in ends]
    return score(experiment, experiment.scenario, Trajectory(np.array([0.0, 1.0]), tuple(still), tuple(directors)))[0]


def thinner(by: float) -> Experiment:
    """The catenary of a cable that is thinner by a factor and has the same weight and axial stiffness, and so the same reference."""
    catenary = registry.load_experiment("catenary")

    def build(**values: float) -> Scenario:
        scenario = catenary.build(**values)
        (rod,) = scenario.rods
        m = rod.material
        dense = Material(m.youngs_modulus * by**2, m.shear_modulus * by**2, m.density * by**2)
        return replace(scenario, rods=(replace(rod, radius=rod.radius / by, material=dense),))

    return replace(catenary, build=build)


def buckling(tension: float, n_elements: int, by: float = 1.0) -> float:
    """Relative error of the twist at which the straight rod of the experiment `twist` loses its stability; of a rod that is thinner
    by a factor and as stiff in bending and twist."""
    scenario = twist.twist.scenario_for(tension=tension)
    rod = scenario.rods[-1]
    stiff = replace(
        rod.material,
        youngs_modulus=rod.material.youngs_modulus * by**4,
        shear_modulus=rod.material.shear_modulus * by**4,
    )
    rods = replace(scenario, rods=(replace(rod, radius=rod.radius / by, material=stiff),))

    def holds(at: float) -> bool:
        path = Rods(rods, n_elements)
        try:
            path.at(0.0)
            path.at(at)
        except NotImplementedError:
            return False
        return True

    low, high = 0.0, twist.RAMP
    assert holds(low) and not holds(high)
    while high - low > RESOLVED * twist.RAMP:
        middle = (low + high) / 2.0
        low, high = (middle, high) if holds(middle) else (low, middle)
    motion = rod.end_motion
    turn = np.interp(low, motion.times, [rotation[0] for rotation in motion.rotation])
    return float(abs(turn / twist.critical_twist(rod, tension) - 1.0))


def main() -> None:
    solvers = sys.argv[1:] or ["endowire", "pyelastica", "mujoco"]
    print("| experiment | solver | elements | errors | processor s (of endowire's) |\n|---|---|---|---|---|")
    for name in STATIC:
        experiment = registry.load_experiment(name)
        n = experiment.n_elements
        print(row(name, "the reference itself", n, reference(experiment)))
        result, own = timed(experiment, "endowire", n)
        print(row(name, "endowire", n, result.metrics, f"{own:.3f}"), flush=True)
        for other in (n // 4 + (n // 4 + 1) % 2, 4 * n + (4 * n + 1) % 2):
            result, spent = timed(experiment, "endowire", other)
            print(row(name, "endowire", other, result.metrics, f"{spent:.3f}"), flush=True)
        if name == "catenary":
            result, spent = timed(thinner(100.0), "endowire", n)
            print(row("the same, a hundredth as thick", "endowire", n, result.metrics, f"{spent:.3f}"), flush=True)
        for other in solvers:
            if other != "endowire":
                result, spent = timed(experiment, other, n)
                print(row(name, other, n, result.metrics, f"{spent:.1f} ({spent / own:.0f})"), flush=True)
    for name in MOVING:
        experiment = registry.load_experiment(name)
        result, _ = timed(experiment, "endowire", experiment.n_elements)
        print(f"| {name} | endowire | {experiment.n_elements} | unsupported: {', '.join(result.missing)} | |")
    tensions = next(p for p in twist.twist.parameters if p.name == "tension").values
    for (tension, by), n in itertools.product([*((t, 1.0) for t in tensions), (30.0, 4.0)], (25, 50, 100)):
        told = {"critical_twist_error": buckling(tension, n, by)}
        print(row(f"twist, tension {tension:g}" + (", a quarter as thick" if by > 1.0 else ""), "endowire", n, told), flush=True)


if __name__ == "__main__":
    main()
