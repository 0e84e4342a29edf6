import copy
import pickle

import numpy as np
import pytest

import endowire


def test_a_step_reports_shape_and_forces(simulation):
    simulation.run(np.tile([[2.0, 0.05]], (70, 1, 1)))
    report = simulation.step(1.0, rotate_rad=[0.1])
    assert report.converged and report.inserted_mm.shape == (1,)
    assert report.inserted_mm[0] == pytest.approx(141.0) and report.rotation_rad[0] == pytest.approx(3.6)
    assert (
        report.contact_positions_mm.shape
        == report.contact_forces_n.shape
        == (len(report.contact_normal_forces_n), 3)
    )
    assert len(report.contact_normal_forces_n) > 0 and (report.contact_normal_forces_n > 0).all()
    told = report.to_dict()
    assert told["push_force_n"] == report.push_force_n[0]
    assert told["substeps"] == report.substeps >= 1 and told["slides"] == report.slides
    assert simulation.positions_mm.shape == simulation.tangents.shape == (len(simulation.from_tip_mm), 3)
    assert np.array_equal(simulation.positions_mm[-1], simulation.tip_mm)
    assert np.array_equal(simulation.points_mm(simulation.from_tip_mm), simulation.positions_mm)


def test_a_tick_has_a_fixed_cost_and_reports_what_is_behind(simulation):
    simulation.run(np.tile([[2.0, 0.05]], (60, 1, 1)))
    stepped = copy.deepcopy(simulation)
    stepped.step(1.0, 0.2)
    report = simulation.tick(1.0, 0.2, solves=1)
    assert report.behind.shape == (1, 2) and report.behind[0] == pytest.approx([1.0, 0.2])
    assert report.solves == report.to_dict()["solves"] < 20
    ticks = 0
    while simulation.report.behind is not None and ticks < 100:
        simulation.tick(solves=8)
        ticks += 1
    assert ticks < 100 and simulation.report.converged
    assert simulation.tip_mm == pytest.approx(stepped.tip_mm, abs=1e-3)
    for wrong in (0, -1):
        with pytest.raises(endowire.InputError, match="solves"):
            simulation.tick(1.0, solves=wrong)


def test_what_is_forgotten_has_no_effect(simulation):
    simulation.run(np.tile([[2.0, 0.05]], (60, 1, 1)))
    assert simulation.most_solves(5.0) > simulation.most_solves() > 100
    assert simulation.most_solves(rotate_rad=0.5) == simulation.most_solves(5.0)
    spared = copy.deepcopy(simulation)
    simulation.tick(1.0, 0.2, solves=1)
    assert simulation.report.behind is not None
    # What is left counts, in costs and in refusals.
    assert simulation.most_solves(5.0) > spared.most_solves(5.0)
    with pytest.raises(endowire.InputError, match="1.000 mm and 0.200 rad .* are behind.*forget"):
        simulation.step(179.5)
    assert simulation.forget() is None
    assert simulation.report.behind is None
    assert simulation.report.inserted_mm.tolist() == spared.report.inserted_mm.tolist()
    for one in (simulation, spared):
        one.step(1.0, 0.2)
    assert np.array_equal(simulation.positions_mm, spared.positions_mm)


def test_copies_share_the_vessel_and_nothing_else(simulation):
    simulation.step(50.0)
    other = copy.deepcopy(simulation)
    other.step(1.0)
    assert simulation.inserted_mm[0] == 50.0 and other.inserted_mm[0] == 51.0


def test_states_are_copied_pickled_and_saved_to_the_bit(simulation, tmp_path):
    simulation.run([[[2.0, 0.1]]] * 40)
    state, shape = simulation.state(), simulation.positions_mm
    simulation.step(3.0)
    after = simulation.positions_mm
    state.save(tmp_path / "state")
    for kept in (
        state,
        copy.copy(state),
        pickle.loads(pickle.dumps(state)),
        endowire.State.load(tmp_path / "state"),
    ):
        simulation.restore(kept)
        assert np.array_equal(simulation.positions_mm, shape)
        simulation.step(3.0)
        assert np.array_equal(simulation.positions_mm, after)
    theirs = tmp_path / "thesis.txt"
    theirs.write_text("mine")
    with pytest.raises(endowire.InputError, match="no state of endowire"):
        state.save(theirs)
    assert theirs.read_text() == "mine"
    state.save(tmp_path / "state")
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(endowire.InputError, match=r"State\.save"):
        endowire.State.from_bytes(b"something else")
    data = state.to_bytes()
    assert endowire.State.from_bytes(data).to_bytes() == data
    for place in (20, len(data) // 2, len(data) - 1):
        changed = bytearray(data)
        changed[place] ^= 1
        with pytest.raises(endowire.InputError, match="changed"):
            endowire.State.from_bytes(bytes(changed))
    for other in (data[:200], data[:-1], data + b"0"):
        with pytest.raises(endowire.InputError, match="not whole"):
            endowire.State.from_bytes(other)


def test_parts_are_pickled(vessel, wire):
    again = pickle.loads(pickle.dumps((vessel, wire)))
    assert np.array_equal(again[0].vertices_mm, vessel.vertices_mm)
    assert np.array_equal(again[0].centreline, vessel.centreline) and again[0].inlet == vessel.inlet
    assert again[1].sections == wire.sections


@pytest.mark.parametrize(
    ("wrong", "kind", "words"),
    [
        (lambda s: s.step(float("nan")), ValueError, "advance_mm = NaN: must be a finite number"),
        (lambda s: s.step("far"), TypeError, "advance_mm = 'far'"),
        (lambda s: s.step([1.0, 2.0]), endowire.InputError, "advance_mm = 2 numbers"),
        (lambda s: s.step(1e6), endowire.InputError, "the device is 300 mm long"),
        (lambda s: s.run(np.zeros((3, 2))), endowire.InputError, r"shape \(n, 1, 2\)"),
        (lambda s: s.restore(None), TypeError, "State"),
    ],
)
def test_wrong_commands_change_nothing(simulation, wrong, kind, words):
    simulation.step(10.0)
    before = simulation.positions_mm
    with pytest.raises(kind, match=words):
        wrong(simulation)
    assert np.array_equal(simulation.positions_mm, before)


def test_wrong_parts_are_named(vessel, wire):
    with pytest.raises(endowire.InputError, match="unknown field `frction`.*`friction`"):
        endowire.Simulation(vessel, wire, wall={"frction": 0.1})
    with pytest.raises(endowire.InputError, match="wall.friction = inf: every number must be finite"):
        endowire.Simulation(vessel, wire, wall={"friction": float("inf")})
    with pytest.raises(endowire.InputError, match="sheath.opening = 7"):
        endowire.Simulation(vessel, wire, opening=7)
    with pytest.raises(endowire.InputError, match="give 1 to 16 instruments"):
        endowire.Simulation(vessel, [])
    with pytest.raises(endowire.InputError, match="no_such.stl"):
        endowire.Vessel.read("no_such.stl")
    with pytest.raises(endowire.InputError, match=r"triangles = 9"):
        endowire.Vessel.from_arrays(np.zeros((3, 3)), [[0, 1, 9]])


def test_arrays_that_are_none_are_named(vessel, wire, simulation):
    points, triangles = vessel.vertices_mm, vessel.triangles
    for wrong, words in (
        (lambda: simulation.points_mm([0.0, np.nan]), r"from_tip_mm\[1\] = NaN: must be a finite number"),
        (lambda: endowire.Batch([simulation]).points_mm([np.nan]), r"from_tip_mm\[0\] = NaN"),
        (lambda: simulation.points_mm(1.0), r"from_tip_mm = an array of shape \[\]: .* shape \(n,\)"),
        (lambda: vessel.contains([0, 0, 10.0]), r"points_mm = an array of shape \[3\]: .* \(n, 3\)"),
        (lambda: endowire.Vessel.from_arrays(points, triangles + 0.9), r"triangles = \d+.9: must be the"),
        (lambda: endowire.Vessel.from_arrays(points, np.full((1, 3), np.nan)), "triangles = NaN: must be"),
        (lambda: endowire.Vessel.from_arrays(points, [[0, 1, -1]]), "triangles = -1: must be the number"),
        (lambda: endowire.Vessel.from_arrays(points, triangles[0]), r"triangles = an array of shape \[3\]"),
        (lambda: endowire.Vessel.generate([0.0, 1.0]), r"tree = an array of shape \[2\]"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            wrong()
    again = endowire.Vessel.from_arrays(points, triangles.astype(float))
    assert np.array_equal(again.triangles, triangles)


def test_negative_numbers_are_named(vessel, wire, simulation, tmp_path):
    line = vessel.centreline[:, :4]
    view = {"views": ["fluoro"], "size_px": [16, 16], "backend": "cpu"}
    for wrong, words in (
        (lambda: endowire.Simulation(vessel, wire, opening=-1), "opening = -1: must be 0 or more"),
        (lambda: endowire.Vessel.generate("curved_tube", triangles=-1), "triangles = -1: must be 0 or more"),
        (lambda: simulation.lateral_forces(-1), "instrument = -1: must be 0 or more"),
        (lambda: endowire.Renderer(vessel, view).render(simulation, frame=-1), "frame = -1: must be 0"),
        (lambda: endowire.Renderer(vessel, view, -1), "plane = -1: must be 0 or more"),
        (lambda: endowire.Controller.follow_path(line, lead=-1), "lead = -1: must be 0 or more"),
        (lambda: endowire.Controller.follow_path(line, followers=[(-1, 5.0)]), "followers = -1: must be 0"),
        (lambda: endowire.Controller.search_ahead(line, turned=[-1]), "turned = -1: must be 0 or more"),
        (lambda: endowire.sweep(tmp_path / "sweep.toml", tmp_path, jobs=-1), "jobs = -1: must be 0 or more"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            wrong()


def test_the_way_ends_where_the_vessel_ends(vessel, wire):
    simulation = endowire.Simulation(vessel, wire)
    with pytest.raises(endowire.EndOfWay, match="left the vessel"):
        simulation.run(np.tile([[5.0, 0.0]], (60, 1, 1)))
    assert simulation.inserted_mm[0] > 200.0


def test_vessels_are_made_checked_and_written(vessel, tmp_path):
    vessel.write(tmp_path / "tube.stl")
    told = endowire.check_vessel(tmp_path / "tube.stl")
    assert told["sound"] and len(told["openings"]) == 2
    again = endowire.Vessel.read(tmp_path / "tube.stl")
    assert len(again.triangles) == len(vessel.triangles) and again.centreline_found
    line = vessel.centreline[:, :3]
    assert vessel.contains(line[1:-1]).all() and not vessel.contains(line + [0.0, 50.0, 0.0]).any()
    table = np.array([[0, 0, 0, 3.0, -1], [0, 0, 40, 3.0, 0]])
    assert len(endowire.Vessel.generate(table, triangles=800).openings) == 2


def test_a_surface_is_checked_as_it_is_or_with_holes_that_are_meant(vessel, tmp_path):
    # A hole in the wall's side: closed, meant, or left as it is.
    middle = vessel.centreline[len(vessel.centreline) // 2, :3]
    centres = vessel.vertices_mm[vessel.triangles].mean(axis=1)
    side = centres[np.argmin(np.linalg.norm(centres - middle, axis=1))]
    path = tmp_path / "hole.obj"
    kept = vessel.triangles[np.linalg.norm(centres - side, axis=1) > 2.5]
    lines = [f"v {x} {y} {z}" for x, y, z in vessel.vertices_mm] + [f"f {a} {b} {c}" for a, b, c in kept + 1]
    path.write_text("\n".join(lines) + "\n")
    openings = [
        len(endowire.check_vessel(path, **options)["openings"])
        for options in ({}, {"keep_open_mm": [side]}, {"repair": "none"})
    ]
    assert openings == [2, 3, 3]
    with pytest.raises(endowire.InputError, match='repair = "some": must be "all" or "none"'):
        endowire.check_vessel(path, repair="some")


def test_a_centre_line_is_found_in_a_surface_and_devices_are_held_against_it(vessel, wire):
    surface = endowire.Vessel.from_arrays(vessel.vertices_mm, vessel.triangles)
    end = f"opening {1 - vessel.inlet}"
    assert surface.centreline_found and not vessel.centreline_found
    found = surface.with_centreline()
    assert found.inlet == vessel.inlet and list(found.targets) == [end] and not found.centreline_found
    # What needs one takes the same by itself.
    assert np.array_equal(surface.centreline, found.centreline) and surface.targets == found.targets
    assert surface.passable(wire, end) == found.passable(wire, end)
    assert np.array_equal(surface.path(end), found.centreline[:, :4])
    low, high = surface.vertices_mm.min(axis=0), surface.vertices_mm.max(axis=0)
    box = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    closed = endowire.Vessel.from_arrays(low + np.array(box) * (high - low), np.array(sides))
    with pytest.raises(endowire.InputError, match="take vessel.with_centreline"):
        closed.path([0.0, 0.0, 0.0])
    (branch,) = found.branches
    assert abs(branch["length_mm"] - sum(np.linalg.norm(np.diff(vessel.centreline[:, :3], axis=0), axis=1))) < 1.0
    assert np.abs(found.centreline[:, 3] - 4.0).max() < 0.3
    place = found.centreline[30, :3].tolist()
    assert list(surface.with_centreline(place, [1]).targets) == ["opening 1"]
    for start, ends, words in ((9, None, "start = opening 9"), (0, [[0.0, 50.0, 0.0]], "ends = ")):
        with pytest.raises(endowire.InputError, match=words):
            surface.with_centreline(start, ends)
    thin = endowire.Instrument.uniform(500.0, 0.4, 10.0)
    thick = endowire.Instrument.uniform(500.0, 4.5, 10.0)
    assert found.passable(thin, end)["passage"] == "passes"
    told = found.passable(thick, found.targets[end])
    assert told["passage"] == "blocked" and told["narrowest"]["clearance_mm"] < 0.0
    assert pickle.loads(pickle.dumps(found)).targets == found.targets
