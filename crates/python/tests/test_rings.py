"""Vessels whose branches meet again: ways by either arm."""

import numpy as np
import pytest

import endowire
from endowire.gym import InsertionVectorEnv, Task, ends, observations, rewards, targets, vessels
from endowire.gym.centreline import Centreline

TRUNK, ENTRY, EXIT = 27, 4, 20


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """A vessel straight along z, and a longer arm beside it from 20 to 100 mm."""
    rows = [f"0 0 {5 * k} 4 {k - 1}" for k in range(TRUNK)]
    rows[-1] += " end"
    parent = ENTRY
    for k in range(1, 10):
        x = 1.6 * k * (10 - k)
        rows.append(f"{x} 0 {20 + 8 * k} 3 {parent}")
        parent = TRUNK + k - 1
    rows[TRUNK + 4] += " far arm"
    rows[-1] += f" last joins {EXIT}"
    path = tmp_path_factory.mktemp("ring") / "ring.csv"
    path.write_text("# x y z radius parent name\n" + "\n".join(rows) + "\n")
    return endowire.Vessel.generate(path, edge_mm=1.5)


def length_mm(path):
    return np.linalg.norm(np.diff(path[:, :3], axis=0), axis=1).sum()


def test_a_path_takes_the_given_arm_of_a_ring(ring, wire):
    assert ring.links == [(len(ring.centreline) - 1, EXIT)]
    straight, around = ring.path("end"), ring.path("end", via="far arm")
    assert length_mm(straight) == pytest.approx(130.0) and straight[:, 0].max() == 0.0
    assert length_mm(around) > 160.0 and around[:, 0].max() > 39.0
    assert np.array_equal(ring.path("end", via=ring.targets["far arm"]), around)
    told = [ring.passable(wire, "end", via=via) for via in (None, "far arm")]
    assert told[0]["length_mm"] == pytest.approx(130.0) and told[1]["length_mm"] == pytest.approx(length_mm(around))
    with pytest.raises(endowire.InputError, match="via = "):
        ring.path("far arm", via="end")
    with pytest.raises(endowire.InputError, match="nowhere"):
        ring.path("end", via="nowhere")


def test_a_surface_has_both_arms(ring):
    surface = endowire.Vessel.from_arrays(ring.vertices_mm, ring.triangles)
    found = surface.with_centreline(ring.inlet)
    assert len(found.links) == 1 and "arm 1" in found.targets
    end = next(name for name in found.targets if name != "arm 1")
    ways = [length_mm(found.path(end)), length_mm(found.path(end, via="arm 1"))]
    exact = [length_mm(ring.path("end")), length_mm(ring.path("end", via="far arm"))]
    assert ways == pytest.approx(exact, rel=0.03)


def test_lengths_on_a_ring_are_those_of_the_shorter_arm(ring):
    table, last = ring.centreline, ring.targets["last"]
    line, tree = Centreline(table, ring.links), Centreline(table)
    link_mm = np.linalg.norm(table[-1, :3] - table[EXIT, :3])
    # By the trunk and back through the re-entry; the tree alone knows the way through the arm only.
    assert line.ways_mm(np.array(last))[0] == pytest.approx(100.0 + link_mm)
    assert tree.ways_mm(np.array(last))[0] > 100.0 + link_mm + 1.0
    path = line.path(np.array(last))
    assert path.length_mm == pytest.approx(100.0 + link_mm) and path.table_mm[:-1, 0].max() == 0.0
    # The way of the library, which knows both arms, is the same.
    assert length_mm(ring.path("last")) == pytest.approx(path.length_mm)
    middle = np.array(ring.targets["far arm"])
    assert line.path(middle).length_mm == pytest.approx(length_mm(ring.path("far arm")))
    # On the link itself, from either side.
    on_link = 0.5 * (table[-1, :3] + table[EXIT, :3])
    assert line.nearest(on_link)[2] == pytest.approx(0.0, abs=1e-9)
    assert line.path(on_link).length_mm == pytest.approx(100.0 + 0.5 * link_mm)


def test_an_environment_measures_by_either_arm(ring, wire):
    task = Task(
        [wire],
        vessels.FixedVessel(ring, opening=ring.inlet),
        target=targets.FixedTarget(tuple(ring.targets["last"])),
        observations={"tip": observations.Tip()},
        rewards=[rewards.Approach()],
        ends=[ends.TargetReached(), ends.StepLimit(5)],
    )
    env = InsertionVectorEnv(task, 1)
    env.reset(seed=1)
    episodes = env.episodes
    whole_mm = length_mm(ring.path("last"))
    assert episodes.paths[0].length_mm == pytest.approx(whole_mm)
    # The sheath reaches a little way in.
    at_mm = episodes.paths[0].nearest(episodes.tip_mm[0])[0]
    assert episodes.way_mm[0] == pytest.approx(whole_mm - at_mm, abs=1e-6)
