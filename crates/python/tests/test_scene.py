from pathlib import Path

import numpy as np
import pytest

import endowire

ASSETS = Path(__file__).parents[3] / "assets"


def test_a_scene_is_simulated_and_drawn():
    scene = endowire.Scene(ASSETS / "scenes" / "curved_tube.toml")
    simulation = scene.simulation()
    simulation.run(scene.moves[:5])
    assert scene.name == "curved_tube" and simulation.inserted_mm[0] == pytest.approx(
        scene.moves[:5, 0, 0].sum()
    )
    renderer = scene.renderer({"views": ["fluoro"], "size_px": [32, 32], "backend": "cpu"})
    assert renderer.render(simulation).fluoro.shape == (32, 32)


def test_a_scene_of_text_has_the_words_of_files():
    text = "[vessel]\ntree = 'curved_tube.csv'\n[device]\n[sheath]\nopning = 0\n"
    with pytest.raises(endowire.InputError, match="line 5.*did you mean `opening`"):
        endowire.Scene(ASSETS / "vessels" / "scene.toml", text)


def test_moves_of_a_script_that_ends_on_a_condition_are_refused():
    text = '''
[vessel]
file = "curved_tube.stl"
[device]
file = "../devices/wire_035_soft.toml"
[sheath]
opening = 0
friction_n = 0.1
[[script]]
advance_mm = 10.0
[[script]]
advance_mm = 10.0
until = { push_force_n = 0.5 }
'''
    scene = endowire.Scene(ASSETS / "vessels" / "scene.toml", text)
    with pytest.raises(endowire.InputError, match=r"script\[1\]\.until.*not known beforehand"):
        _ = scene.moves
    documented = endowire.Scene.moves.__doc__
    assert "`until`" in documented and "`detach`" in documented


def test_rod_cases_are_solved():
    solution = endowire.solve_rod(ASSETS / "cases" / "tip_force.toml")
    assert solution["converged"] and np.asarray(solution["nodes"]).shape[1] == 3


def test_device_files_are_read():
    assert endowire.Instrument.read(ASSETS / "devices" / "wire_035_shaped.toml").length_mm > 100.0
