"""Several instruments that lie in one another."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import endowire
from endowire import gym

ASSETS = Path(__file__).parents[3] / "assets"

SCENE = """
name = "two"
[vessel]
tree = "vessels/curved_tube.csv"
edge_mm = 2.0
[[instrument]]
name = "wire"
friction = 0.1
inserted_mm = 10.0
[[instrument.section]]
length_mm = 300.0
radius_mm = 0.2
bending_stiffness_nmm2 = 5.0
[[instrument]]
name = "catheter"
[[instrument.section]]
length_mm = 150.0
radius_mm = 0.6
inner_radius_mm = 0.3
bending_stiffness_nmm2 = 15.0
[sheath]
opening = 0
friction_n = 0.05
[method]
name = "kirchhoff"
element_mm = 5.0
[[script]]
instrument = "wire"
advance_mm = 60.0
step_mm = 3.0
with = [{ instrument = "catheter", advance_mm = 40.0, step_mm = 3.0 }]
[[script]]
instrument = "catheter"
advance_mm = 20.0
rotate_deg = 30.0
step_mm = 5.0
"""


def wire_and_catheter():
    tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 2.0}
    wire = endowire.Instrument(
        [
            {**tip, "rest_curvature_per_mm": [0.05, 0.0]},
            {**tip, "length_mm": 285.0, "bending_stiffness_nmm2": 6.0},
        ]
    )
    catheter = endowire.Instrument(
        [{"length_mm": 150.0, "radius_mm": 0.6, "inner_radius_mm": 0.3, "bending_stiffness_nmm2": 15.0}]
    )
    return [wire, catheter]


@pytest.fixture(scope="module")
def several(vessel):
    return endowire.Simulation(
        vessel,
        wire_and_catheter(),
        method={"name": "kirchhoff", "element_mm": 5.0},
        sheath_friction_n=0.05,
        friction=[0.1, 0.0],
        names=["wire", "catheter"],
    )


def test_each_hand_has_its_own_lengths_turns_and_forces(several):
    simulation = several.copy()
    assert simulation.n_instruments == 2 and len(simulation.instruments) == 2
    simulation.run(np.tile([[2.0, 0.0], [1.5, 0.0]], (40, 1, 1)))
    report = simulation.step([1.0, 2.0], rotate_rad=[0.3, 0.0])
    assert report.inserted_mm.tolist() == pytest.approx([81.0, 62.0])
    assert np.array_equal(report.inserted_mm, simulation.inserted_mm)
    assert report.rotation_rad.tolist() == pytest.approx([0.3, 0.0])
    assert (
        report.push_force_n.shape == report.torque_nmm.shape == (2,)
        and np.isfinite(report.push_force_n).all()
    )
    assert report.to_dict()["push_force_n"] == pytest.approx(report.push_force_n.sum(), abs=0.2)
    tips = simulation.tips_mm
    assert np.array_equal(tips[0], simulation.tip_mm)
    assert np.allclose(simulation.points_mm([19.0])[0], tips[1])
    held = simulation.lateral_forces(0)
    assert held["force_n"].shape == simulation.positions_mm.shape and np.abs(held["force_n"]).max() > 0.0
    assert held["tension_n"].shape == held["friction_n"].shape == (len(simulation.from_tip_mm),)
    with pytest.raises(endowire.InputError, match="instrument = 2: there are 2"):
        simulation.lateral_forces(2)


def test_a_force_that_jumps_is_nan(several):
    report = several.copy().step([5.0, 5.0])
    assert np.isnan(report.push_force_n).all() and report.inserted_mm.tolist() == [5.0, 5.0]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda s: s.step(1.0), "advance_mm = 1: must be 2 numbers"),
        (lambda s: s.step([1.0, 2.0, 3.0]), "advance_mm = 3 numbers: must be 2"),
        (lambda s: s.step([np.nan, 0.0]), "wire.advance_mm = NaN"),
        (lambda s: s.step([0.0, 200.0]), "catheter.advance_mm = 200: the device is 150 mm long"),
        (lambda s: s.run(np.zeros((3, 1, 2))), r"must have the shape \(n, 2, 2\)"),
        (lambda s: endowire.Batch([s]).step(np.zeros((1, 1, 2))), r"must have the shape \(1, 2, 2\)"),
    ],
)
def test_wrong_moves_are_named_and_change_nothing(several, wrong, words):
    simulation = several.copy()
    simulation.step([20.0, 10.0])
    before = simulation.positions_mm
    with pytest.raises(endowire.InputError, match=words):
        wrong(simulation)
    assert np.array_equal(simulation.positions_mm, before)


def test_wrong_stacks_are_named(vessel):
    instruments = wire_and_catheter()
    for options, words in (
        ({"friction": [0.1]}, "friction = 1: there are 2 instruments"),
        ({"friction": [0.1, 0.1]}, r"instrument\[1\].friction = 0.1: the last"),
        ({"names": ["a", "a"]}, "every instrument has a name of its own"),
        ({"may_lead": [True]}, "may_lead = 1: there are 2"),
        ({"method": {"name": "li2011-banded"}}, "pushes one device and no more"),
        ({"sheath_friction_n": -1.0}, "friction_n = -1"),
        ({"bends_towards": [0.0, 0.0, 0.0]}, "sheath.bends_towards = "),
    ):
        with pytest.raises(endowire.InputError, match=words):
            endowire.Simulation(vessel, instruments, **options)
    simulation = endowire.Simulation(vessel, instruments[::-1])
    with pytest.raises(endowire.InputError, match="lumen"):
        simulation.step([10.0, 10.0])
    behind = endowire.Simulation(vessel, instruments, may_lead=[True, False])
    with pytest.raises(endowire.InputError, match="lead"):
        behind.step([1.0, 2.0])


def test_states_and_batches_give_the_bits_of_one_by_one(several):
    alone = [several.copy() for _ in range(3)]
    batch = endowire.Batch(alone)
    rng = np.random.default_rng(2)
    for _ in range(15):
        moves = rng.uniform([0.0, -0.2], [4.0, 0.2], (3, 2, 2))
        moves[:, 1, 0] /= 2.0
        assert batch.step(moves) == {}
        for one, move in zip(alone, moves, strict=True):
            one.step(move[:, 0], rotate_rad=move[:, 1])
    state = pickle.loads(pickle.dumps(batch.state(1)))
    again = several.copy()
    again.restore(state)
    assert np.array_equal(again.positions_mm, alone[1].positions_mm)
    for k, one in enumerate(alone):
        assert np.array_equal(batch.inserted_mm[k], one.inserted_mm)
        assert np.array_equal(batch.tips_mm[k], one.tips_mm)
        assert np.array_equal(batch.push_force_n[k], one.report.push_force_n, equal_nan=True)
    assert batch.push_force_n.shape == (3, 2)


def test_a_batch_has_one_number_of_instruments(several, simulation):
    with pytest.raises(endowire.InputError, match="instruments = 1: a batch has .* here 2"):
        endowire.Batch([several, simulation])
    batch = endowire.Batch([several])
    with pytest.raises(endowire.InputError, match="instruments = 1"):
        batch.replace(0, simulation)


def test_a_scene_of_several_is_stepped_run_and_drawn():
    scene = endowire.Scene(ASSETS / "scene.toml", SCENE)
    simulation, other = scene.simulation(), scene.simulation()
    assert simulation.inserted_mm.tolist() == pytest.approx([10.0, 0.0])
    moves = scene.moves
    assert moves.shape == (26, 2, 2) and moves[..., 0].sum(axis=0) == pytest.approx([60.0, 60.0])
    simulation.run(moves)
    scene.run(other)
    assert np.array_equal(simulation.positions_mm, other.positions_mm)
    assert simulation.inserted_mm.tolist() == pytest.approx([70.0, 60.0])
    # Large enough that the wire covers pixels by half: those are its mask.
    renderer = scene.renderer({"views": ["3d", "fluoro"], "size_px": [512, 512], "backend": "cpu"})
    assert renderer.render(simulation).three_d.shape == (512, 512, 4)
    labels = renderer.labels(simulation)
    assert len(labels["devices"]) == 2 and {1, 2} <= set(np.unique(labels["mask"]).tolist())
    # What is out is not seen.
    simulation.step([0.0, -60.0])
    labels = renderer.labels(simulation)
    assert len(labels["devices"]) == 2 and set(np.unique(labels["mask"]).tolist()) == {0, 1}
    made_of = scene.renderer({"device": [{"material": "platinum"}], "size_px": [16, 16], "backend": "cpu"})
    with pytest.raises(endowire.InputError, match="view.device = 1: describes one device"):
        made_of.render(simulation)


def test_a_script_with_a_condition_is_run():
    line = '[[script]]\ninstrument = "wire"\nadvance_mm = 200.0\nstep_mm = 2.0\nuntil = { push_force_n = 0.051 }\n'
    scene = endowire.Scene(ASSETS / "scene.toml", SCENE.split("[[script]]")[0] + line)
    with pytest.raises(endowire.InputError, match=r"script\[0\]\.until.*Scene\.run"):
        _ = scene.moves
    simulation = scene.simulation()
    report = scene.run(simulation)
    assert 100.0 < report.inserted_mm[0] < 190.0 and report.push_force_n[0] >= 0.051


def test_environments_move_each_instrument(vessel):
    task = gym.Task(
        wire_and_catheter(),
        gym.vessels.FixedVessel(vessel),
        coupling={"friction": [0.1, 0.0], "names": ["wire", "catheter"]},
        actions="physical",
    )
    env = gym.InsertionEnv(task)
    assert env.action_space.shape == (4,)
    check_env(env, skip_render_check=True)
    env.reset(seed=1)
    for _ in range(10):
        *_, info = env.step(np.array([[30.0, 0.5], [15.0, 0.0]]))
    assert info["failure"] == "" and env.unwrapped.episodes.batch.inserted_mm[0].tolist() == pytest.approx(
        [40.0, 20.0]
    )
    vector = gym.InsertionVectorEnv(task, 2)
    vector.reset(seed=[1, 2])
    for _ in range(10):
        vector.step(np.tile([[30.0, 0.5], [15.0, 0.0]], (2, 1, 1)))
    assert np.array_equal(vector.episodes.tip_mm[0], env.episodes.tip_mm[0])
