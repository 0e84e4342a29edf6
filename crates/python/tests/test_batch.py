import numpy as np
import pytest

import endowire


def test_a_batch_gives_the_bits_of_one_by_one(simulation):
    alone = [simulation.copy() for _ in range(5)]
    batch = endowire.Batch(alone)
    rng = np.random.default_rng(1)
    for _ in range(25):
        moves = rng.uniform([-1.0, -0.3], [5.0, 0.3], (5, 1, 2))
        moves[:, :, 0] = np.maximum(moves[:, :, 0], -batch.inserted_mm)
        assert batch.step(moves) == {}
        for one, move in zip(alone, moves, strict=True):
            one.step(*move[0])
    lengths = [0.0, 3.0, 20.0]
    for k, one in enumerate(alone):
        assert np.array_equal(batch.points_mm(lengths)[k], one.points_mm(lengths))
        assert np.array_equal(batch.tip_mm[k], one.tip_mm)
        assert np.array_equal(batch.push_force_n[k], one.report.push_force_n)
    assert batch.converged.all() and (batch.left_through == -1).all()


def test_a_failure_is_a_value_and_the_others_go_on(simulation):
    batch = endowire.Batch([simulation] * 3)
    failures = batch.step([[[1.0, 0.0]], [[np.nan, 0.0]], [[-5.0, 0.0]]])
    assert sorted(failures) == [1, 2] and all(isinstance(f, endowire.InputError) for f in failures.values())
    assert "advance_mm = NaN" in str(failures[1]) and "0 mm are inserted" in str(failures[2])
    assert batch.inserted_mm[:, 0].tolist() == [1.0, 0.0, 0.0]


def test_wrong_moves_step_nothing(simulation):
    batch = endowire.Batch([simulation] * 2)
    for moves in (np.zeros((3, 1, 2)), np.zeros((2, 2, 2)), np.zeros((2, 2)), 1.0):
        with pytest.raises((endowire.InputError, TypeError)):
            batch.step(moves)
    with pytest.raises((TypeError, ValueError)):
        batch.step("push")
    assert (batch.inserted_mm == 0.0).all()


def test_members_are_restored_and_exchanged(simulation):
    batch = endowire.Batch([simulation, simulation])
    start = batch.state(0)
    batch.step([[[4.0, 0.0]], [[7.0, 0.0]]])
    batch.restore(0, start)
    batch.replace(-1, batch.simulation(0))
    assert len(batch) == 2 and (batch.inserted_mm == 0.0).all()
    with pytest.raises(IndexError):
        batch.state(2)


def test_those_that_are_named_forget(simulation):
    batch = endowire.Batch([simulation] * 3)
    for _ in range(30):
        batch.step(np.tile([[2.0, 0.05]], (3, 1, 1)))
    batch.tick(np.tile([[1.0, 0.2]], (3, 1, 1)), solves=1)
    assert (batch.behind[..., 0] > 0.0).all()
    with pytest.raises(IndexError):
        batch.forget([0, 3])
    assert (batch.behind[..., 0] > 0.0).all()
    batch.forget([0, -1])
    assert (batch.behind[[0, 2]] == 0.0).all() and (batch.behind[1, :, 0] > 0.0).all()
    batch.forget()
    assert (batch.behind == 0.0).all()
    assert batch.inserted_mm[:, 0] == pytest.approx([60.0] * 3)
