"""The adapter of benches/cosseratbench, in the experiments of that package that take seconds."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

experiment = pytest.importorskip(
    "cosseratbench.experiment", reason="cosseratbench is not installed: its adapter is not tried"
)
FOLDER = Path(__file__).parents[3] / "benches" / "cosseratbench"
sys.path.insert(0, str(FOLDER))

from cosseratbench.experiments.cantilever import cantilever
from cosseratbench.experiments.capstan import capstan
from cosseratbench.experiments.crossing import crossing
from cosseratbench.experiments.pendulum import pendulum
from endowire_cosseratbench import EndowireSolver, equilibrium
from figures import reference, thinner


def test_the_entry_point_is_the_adapter():
    assert 'endowire = "endowire_cosseratbench:EndowireSolver"' in (FOLDER / "pyproject.toml").read_text()


def test_a_cantilever_is_as_beam_theory_has_it():
    # The experiment's own bound for what the linear theory leaves out.
    assert experiment.run(cantilever, EndowireSolver(), n_elements=5).metrics["tip_deflection_error"] < 1e-3
    # One that is a tenth stiffer is seen.
    rod = cantilever.scenario.rods[0]
    stiffer = replace(rod, material=replace(rod.material, youngs_modulus=1.1e6))
    wrong = EndowireSolver().run(replace(cantilever.scenario, rods=(stiffer,)), n_elements=5, n_frames=3)
    assert experiment.score(cantilever, cantilever.scenario, wrong)[0]["tip_deflection_error"] > 0.05


def test_a_cable_without_stiffness_hangs_as_a_catenary():
    errors = [
        experiment.run(thinner(by), EndowireSolver(), n_elements=50).metrics["shape_error"] for by in (1.0, 100.0)
    ]
    # What the reference leaves out goes with the square of the radius.
    assert errors[1] < 1e-6 and errors[0] > 1e-4


def test_ropes_that_touch_are_where_the_reference_has_them():
    result = experiment.run(crossing, EndowireSolver(), n_frames=3)
    least = reference(crossing)
    for name in ("shape_error", "lift_error"):
        assert result.metrics[name] == pytest.approx(least[name], rel=0.01)
    # Ropes that pass through each other are seen.
    scenario, n = crossing.scenario, crossing.n_elements
    free = [equilibrium(rod, np.asarray(scenario.gravity), n).sampled(n) for rod in scenario.rods]
    through = replace(
        result.trajectory, positions=tuple(np.stack([shape, shape]) for shape, _ in free),
        directors=tuple(np.stack([turned, turned]) for _, turned in free), times=np.array([0.0, 1.0]),
    )  # fmt: skip
    assert experiment.score(crossing, scenario, through)[0]["shape_error"] > 0.01


def test_what_needs_time_or_obstacles_is_unsupported():
    for asked, solver, words in (
        (pendulum, EndowireSolver(), "motion in time"),
        (capstan, EndowireSolver(), "cylinder_contact"),
        (cantilever, EndowireSolver(time_step_scale=2.0), "a time step"),
    ):
        result = experiment.run(asked, solver)
        assert result.outcome == "unsupported" and words in result.missing[0]
    slippery = tuple(replace(rod, friction=0.3) for rod in crossing.scenario.rods)
    with pytest.raises(NotImplementedError, match="friction between rods"):
        EndowireSolver().run(replace(crossing.scenario, rods=slippery), n_elements=13, n_frames=2)
