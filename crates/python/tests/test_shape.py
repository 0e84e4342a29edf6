"""The example that shapes the tip of a catheter to a branch."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[1] / "examples" / "shape_tip.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("shape_tip", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("angle_deg", [40.0, 60.0, 80.0])
def test_a_shaped_tip_goes_into_the_branch_and_a_straight_one_passes_by(example, angle_deg):
    found, walls = example.shape(angle_deg)
    assert found.converged and not found.not_shown
    assert example.way_in_mm(angle_deg, walls, found.values) > 40.0
    assert example.way_in_mm(angle_deg, walls, [0.0, 0.0]) < 20.0
    # It is the least sum of squares: other shapes are farther from what is wanted.
    start, moves, observed = found.simulation, example.moves(angle_deg), [example.wanted(angle_deg)]
    gradient = start.gradients(moves, by=found.free)[-1]
    residual, slope = observed[0].residual(gradient)
    assert residual @ residual == pytest.approx(found.chi2, rel=1e-6)
    normal = np.linalg.norm(slope, axis=0) * np.linalg.norm(residual)
    assert np.all(np.abs(slope.T @ residual) < 0.05 * normal)


def test_the_example_says_what_it_found(example, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["shape_tip.py", "60"])
    example.main()
    assert "branch at 60°: bends of" in capsys.readouterr().out
