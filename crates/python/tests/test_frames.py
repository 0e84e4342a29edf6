import numpy as np
import pytest

import endowire

VIEW = {"views": ["3d", "fluoro"], "size_px": [48, 32], "backend": "cpu"}


def test_both_views_and_labels_are_arrays(vessel, simulation):
    simulation.run([[[5.0, 0.0]]] * 16)
    renderer = endowire.Renderer(vessel, VIEW)
    frames = renderer.render(simulation, frame=3)
    assert frames.three_d.shape == (32, 48, 4) and frames.three_d.dtype == np.uint8
    assert frames.fluoro.shape == (32, 48) and frames.fluoro.dtype == np.uint8
    # Pixels much smaller than the wire: a mask is what it covers by half.
    renderer = endowire.Renderer(vessel, {**VIEW, "views": ["fluoro"], "size_px": [640, 640]})
    labels = renderer.labels(simulation)
    device = labels["devices"][0]
    assert labels["mask"].max() == 1 and device["tip_visible"]
    x, y = device["tip_px"]
    near = labels["mask"][max(int(y) - 1, 0) : int(y) + 2, max(int(x) - 1, 0) : int(x) + 2]
    assert near.any() and device["centre_line_px"].shape[1] == 2
    assert labels["vessel"].shape == (640, 640) and labels["vessel"].any()
    u, v, w = labels["camera_matrix"] @ [*device["tip_mm"], 1.0]
    assert np.allclose([u / w, v / w], [x, y]) and np.isclose(w, device["depth_mm"][-1])
    assert device["centre_line_mm"].shape == (len(device["centre_line_px"]), 3)


def test_sixteen_bits_and_one_view(vessel, simulation):
    simulation.step(50.0)
    frames = endowire.Renderer(vessel, {**VIEW, "views": ["fluoro"], "bits": 16}).render(simulation)
    assert frames.three_d is None and frames.fluoro.dtype == np.uint16 and frames.fluoro.max() > 255


def test_the_second_plane_is_the_first_turned(vessel, simulation):
    simulation.run([[[5.0, 0.0]]] * 16)
    view = {**VIEW, "c_arm": {"primary_deg": 30.0}, "biplane_deg": -90.0}
    matrices = [endowire.Renderer(vessel, view, plane).labels(simulation)["camera_matrix"] for plane in (0, 1)]
    single = {**view, "biplane_deg": None}
    assert np.array_equal(matrices[0], endowire.Renderer(vessel, single).labels(simulation)["camera_matrix"])
    turned = {**single, "c_arm": {"primary_deg": -60.0}}
    assert np.array_equal(matrices[1], endowire.Renderer(vessel, turned).labels(simulation)["camera_matrix"])
    assert not np.array_equal(*matrices)
    frames = endowire.Renderer(vessel, view, plane=1).render(simulation)
    assert frames.three_d is None and frames.fluoro.shape == (32, 48)
    with pytest.raises(endowire.InputError, match="plane = 1.*biplane_deg"):
        endowire.Renderer(vessel, single, 1)
    with pytest.raises(endowire.InputError, match="plane = 2"):
        endowire.Renderer(vessel, view, 2)


def test_an_injection_outside_the_vessel_is_refused(vessel):
    def view(at_mm):
        one = {"at_mm": at_mm, "start_s": 0.0, "rate_ml_per_s": 3.0, "duration_s": 2.0}
        return {"views": ["fluoro"], "size_px": [32, 32], "injection": [one]}

    with pytest.raises(endowire.InputError, match=r"view\.injection\[0\]\.at_mm"):
        endowire.Renderer(vessel, view([500.0, 0.0, 0.0]))
    endowire.Renderer(vessel, view([0.0, 0.0, 20.0]))


def test_a_wrong_view_is_named(vessel):
    with pytest.raises(endowire.InputError, match="unknown field `sizepx`"):
        endowire.Renderer(vessel, {"sizepx": [1, 1]})
    with pytest.raises(endowire.InputError, match="view.size_px"):
        endowire.Renderer(vessel, {"size_px": [0, 1]})
