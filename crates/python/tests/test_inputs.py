"""What is given to the package: what is taken, and the one line about what is not."""

import types
from pathlib import Path

import numpy as np
import pytest

import endowire

SCENES = Path(__file__).parents[3] / "assets" / "scenes"


def test_numpy_and_other_values_are_taken_in_dictionaries(vessel, wire):
    wall = types.MappingProxyType({"friction": np.float32(0.1), "modulus_n_per_mm2": np.int64(2)})
    section = {"length_mm": np.float64(50), "radius_mm": np.array(0.4), "bending_stiffness_nmm2": 10}
    bent = endowire.Instrument(({**section, "rest_curvature_per_mm": np.array([0.05, 0.0])},))
    simulation = endowire.Simulation(
        vessel, bent, wall=wall, position_mm=np.array([0, 0, 1.0]), direction=(0, 0, 1)
    )
    simulation.set_fields(
        [
            {
                "kind": "magnet",
                "end_mm": np.float32(4),
                "moment_am2": 1e-3,
                "field_t": np.array([0.0, 0.0, 0.05]),
            }
        ]
    )
    simulation.step(10.0)
    for size_px in (np.array([40, 30]), [np.int64(40), 30], (40, 30)):
        renderer = endowire.Renderer(vessel, {"views": ["fluoro"], "size_px": size_px, "backend": "cpu"})
        assert renderer.render(simulation).fluoro.shape == (30, 40)


def test_a_method_needs_no_name(vessel, wire):
    unnamed = endowire.Simulation(vessel, wire, method={"element_mm": 4.0})
    named = endowire.Simulation(vessel, wire, method={"name": "kirchhoff", "element_mm": 4.0})
    for one in (unnamed, named):
        one.step(30.0)
    assert np.array_equal(unnamed.positions_mm, named.positions_mm)


def loop():
    items = []
    items.append(items)
    return items


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"wall": [1000.0, 0.3]}, r"wall = \[1000.0, 0.3\]: must be a dictionary"),
        ({"wall": 5}, "wall = 5: must be a dictionary"),
        (
            {"wall": {"friction": np.array([1.0, np.nan])}},
            r"wall.friction\[1\] = NaN: every number must be finite",
        ),
        ({"wall": {"friction": object()}}, "wall.friction = <object.*: must be a number, text"),
        ({"wall": {"friction": loop()}}, "is nested more than 64 times"),
        ({"wall": {5: 1.0}}, "wall = 5: is no key"),
        ({"wall": {"friction": 2**70}}, "wall.friction = .*: is too large a number"),
        ({"wall": {"frction": 0.1}}, "wall: unknown field `frction`.*did you mean `friction`"),
        ({"wall": {"region": [[1.0]]}}, r"wall"),
        ({"method": "kirchhoff"}, "method = 'kirchhoff': must be a dictionary"),
        ({"method": ["kirchhoff"]}, "method = .*: must be a dictionary"),
        ({"method": {"name": "kirchof"}}, "did you mean `kirchhoff`"),
        (
            {"position_mm": [0.0, 0.0], "direction": [0, 0, 1]},
            r"position_mm = .*\[2\]: must have the shape \(3,\)",
        ),
        (
            {"position_mm": [0, 0, np.inf], "direction": [0, 0, 1]},
            r"position_mm = \[0.0, 0.0, inf\]: every number",
        ),
        ({"opening": -1}, "opening = -1: must be 0 or more"),
        ({"opening": 2**70}, "opening = .*: is too large a number"),
        ({"opening": -(2**70)}, "opening = .*: must be 0 or more"),
    ],
)
def test_a_wrong_argument_is_named(vessel, wire, arguments, words):
    with pytest.raises(endowire.InputError, match=words) as told:
        endowire.Simulation(vessel, wire, **arguments)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (
            lambda v, s: endowire.Simulation(v, s.instruments[0], opening=True),
            "opening = True: must be a whole",
        ),
        (
            lambda v, s: endowire.Simulation(v, s.instruments[0], opening=1.0),
            "opening = 1.0: must be a whole",
        ),
        (lambda v, s: endowire.Simulation(v, s.instruments[0], position_mm="here"), "position_mm = 'here'"),
        (lambda v, s: endowire.Simulation(v, ["a"]), r"instruments = \['a'\]: must be an Instrument"),
        (lambda v, s: v.path(5.0j), "to = "),
        # numpy takes these for numbers.
        (lambda v, s: s.step(advance_mm=b"x"), "advance_mm = b'x': must be a number"),
        (lambda v, s: s.step("12"), "advance_mm = '12': must be a number"),
        (lambda v, s: s.step(1.0, rotate_rad=[None]), r"rotate_rad = \[None\]: must be a number"),
        (lambda v, s: s.step(np.array([1.0 + 2.0j])), r"advance_mm = array\(\[1.\+2.j\]\): must be a number"),
        (lambda v, s: s.tick(np.complex64(1.0 + 2.0j), solves=8), "advance_mm = .*: must be a number"),
        (lambda v, s: s.step(np.ones((2, 2))), r"advance_mm = array\(\[\[1., 1.\], \[1., 1.\]\]\): must be"),
        (lambda v, s: s.points_mm(np.array([1.0 + 2.0j])), "items of type complex128: must be real numbers"),
        (lambda v, s: s.points_mm(np.array([1.0, "2"], dtype=object)), "'2': must be real numbers"),
        (lambda v, s: s.run(np.zeros((2, 1, 2), dtype=complex)), "must be real numbers"),
        (lambda v, s: endowire.Batch([s]).step([[[1.0j, 0.0]]]), "1j: must be real numbers"),
        (lambda v, s: endowire.Record().note(s, 1.0, [1.0j]), r"advance_mm = \[1j\]: must be a number"),
        (lambda v, s: endowire.Simulation(v, s.instruments[0], friction=np.array([1.0j])), "must be real numbers"),
        (lambda v, s: endowire.Simulation(v, s.instruments[0], friction=b"x"), "b'x' is no list"),
        (lambda v, s: endowire.Renderer(v, {}, plane="a"), "plane = 'a': must be a whole"),
    ],
)
def test_a_wrong_type_is_named_on_one_line(vessel, simulation, work, words):
    with pytest.raises(TypeError, match=words) as told:
        work(vessel, simulation)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda v, s: s.tick(1.0, solves=2**70), "solves = .*: is too large"),
        (
            lambda v, s: s.points_mm([0.0, -5.0]),
            r"from_tip_mm\[1\] = -5: must be a finite number of 0 or more",
        ),
        (lambda v, s: endowire.Batch([s]).points_mm([-5.0]), r"from_tip_mm\[0\] = -5"),
        (lambda v, s: s.lateral_forces(-1), "instrument = -1"),
        (lambda v, s: endowire.Record().note(s, 1.0, np.nan), "advance_mm = NaN: must be a finite number"),
        (
            lambda v, s: endowire.Record().note(s, 1.0, 1.0, np.inf),
            "rotate_rad = inf: must be a finite number",
        ),
        (
            lambda v, s: endowire.Batch([s]).note([endowire.Record()], [[[np.nan, 0.0]]], [1.0]),
            "advance_mm = NaN: must be a finite number",
        ),
        (
            lambda v, s: v.contains([[0.0, 0.0, 5.0], [np.nan, 0.0, 0.0]]),
            r"points_mm\[1\] = .*: every number",
        ),
        (lambda v, s: v.path([np.nan, 0.0, 0.0]), r"to = \[NaN, 0.0, 0.0\]: every number must be finite"),
        (lambda v, s: v.path([0.0, 0.0]), r"to = .*: must have the shape \(3,\)"),
        (lambda v, s: v.path(v.centreline[0, :3].tolist()), r"to = \[0.0, 0.0, 0.0\]: is at the root"),
        (lambda v, s: v.with_centreline(start=[np.nan, 0.0, 0.0]), "start = .*: every number must be finite"),
        (lambda v, s: v.with_centreline(ends=[-1]), r"ends\[0\] = -1: must be 0 or more"),
        (
            lambda v, s: endowire.Controller.follow_path(v.path([0.0, 0.0, 60.0]), arrived_mm=-1.0),
            "arrived_mm = -1",
        ),
        (
            lambda v, s: endowire.Controller.search_ahead(v.path([0.0, 0.0, 60.0]), arrived_mm=np.nan),
            "arrived_mm",
        ),
        (
            lambda v, s: endowire.Controller.follow_path([[0.0, 0.0, 0.0, 2.0], [0.0, 0.0, 9.0, -5.0]]),
            r"path_mm\[1\]\[3\] = -5: is a radius",
        ),
        (
            lambda v, s: endowire.Controller.follow_path(v.path([0.0, 0.0, 60.0]), followers=[(1, -3.0)]),
            "followers = -3: must be a distance",
        ),
        (lambda v, s: endowire.Renderer(v, [[64, 64]]), "view = .*: must be a dictionary"),
        (lambda v, s: endowire.Renderer(v, {"c_arm": []}), r"view.c_arm = .*: must be a dictionary"),
        (lambda v, s: endowire.Renderer(v, {"views": ["flouro"]}), "did you mean `fluoro`"),
        (lambda v, s: endowire.Renderer(v, {"views": []}).render(s), r"view.views = \[\]: nothing is drawn"),
        (
            lambda v, s: endowire.Instrument([[10.0, 0.4, None, 1.0]]),
            r"sections\[0\] = .*: must be a dictionary",
        ),
        (
            lambda v, s: endowire.Instrument({"length_mm": 10.0}),
            "sections = .*: must be a list of dictionaries",
        ),
        (lambda v, s: endowire.solve_rod(5), "case = 5: must be a dictionary"),
    ],
)
def test_a_wrong_value_is_named_by_its_key(vessel, simulation, work, words):
    with pytest.raises(endowire.InputError, match=words) as told:
        work(vessel, simulation)
    assert "\n" not in str(told.value)


def test_lengths_from_the_tip_may_be_below_zero_by_rounding(simulation):
    simulation.step(10.0)
    assert np.array_equal(simulation.points_mm([-1e-12])[0], simulation.tip_mm)


def test_an_unknown_anatomy_names_those_that_there_are(tmp_path, monkeypatch):
    with pytest.raises(endowire.InputError, match="basilar_aneurysm.*did you mean `aortic_arch`") as told:
        endowire.Vessel.generate("aortic_arc")
    assert str(told.value).startswith('tree = "aortic_arc": is no file')
    with pytest.raises(endowire.InputError, match="arch.csv: No such file"):
        endowire.Vessel.generate(tmp_path / "arch.csv")
    documented = endowire.Vessel.generate.__doc__
    for name in ("aortic_arch_ii", "aortic_arch_iii", "sidewall_aneurysm", "basilar_aneurysm", "hepatic"):
        assert f'"{name}"' in documented


def test_one_number_is_taken_alone_and_in_any_list(simulation):
    taken = [1.0, 1, np.float32(1.0), [1.0], (1,), np.array(1.0), np.array([1]), range(1, 2)]
    for number in taken:
        simulation.step(number, [0.0])
    assert simulation.inserted_mm == pytest.approx([len(taken)])
