"""Simulations as functions of PyTorch and JAX. With neither installed, layers are run against modules that have what they use."""

import importlib
import sys
import types
import warnings

import numpy as np
import pytest

import endowire
from endowire.autodiff import Response
from endowire.gym import InsertionEnv, arches, tasks

#: A node of the mesh comes in: what differentiates by the push says so.
pytestmark = pytest.mark.filterwarnings("ignore:.*on one side only:RuntimeWarning")
METHOD = {"name": "kirchhoff", "element_mm": 4.0, "tolerance": 1e-11}
MOVES = np.array([[[1.3, 0.05]], [[1.0, 0.0]]])
BY, OF = ["advance", "EI[0]", "rest_u[0]"], ["tip", "push_force"]


@pytest.fixture(scope="module")
def inserted():
    tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 5.0, "rest_curvature_per_mm": [0.06, 0.0]}
    wire = endowire.Instrument([tip, {"length_mm": 300.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 12.0}])
    simulation = endowire.Simulation(endowire.Vessel.generate("curved_tube"), wire, method=METHOD)
    for _ in range(20):
        simulation.step(2.0, 0.03)
    return simulation


@pytest.fixture(scope="module")
def jumping():
    """A soft wire before a branch, and commands that turn it and push it on: it snaps on the way."""
    env = InsertionEnv(tasks.arch_variety(vessels=arches.ArchVariety(count=None)))
    env.reset(seed=900_003)
    simulation = env.simulation
    for _ in range(44):
        simulation.step(4.0)
    return simulation, np.array([[[0.0, 1.0]], *[[[4.0, 0.0]]] * 7])


def differences(response, at, of, h=1e-4):
    columns = []
    for k in range(len(at)):
        there = [response.numbers(at + sign * h * np.eye(len(at))[k])[of] for sign in (1.0, -1.0)]
        columns.append((there[0] - there[1]) / (2.0 * h))
    return np.stack(columns, axis=1)


def test_derivatives_are_limits_of_differences(inserted):
    response = Response(inserted, MOVES, BY[:1], OF)
    found, slopes = response.linear(response.start + 0.2)
    assert all(np.allclose(one, as_run, atol=1e-9) for one, as_run in zip(found, response.numbers(response.start + 0.2), strict=True))
    for of, slope in enumerate(slopes):
        assert slope == pytest.approx(differences(response, response.start + 0.2, of, 1e-5), rel=1e-3, abs=1e-6)
    with pytest.warns(RuntimeWarning, match=r"derivatives by \['advance'\] hold on one side only"):
        response.linear(response.start)
    assert response.start.tolist() == [1.3] and Response(inserted, MOVES, BY, OF).start.tolist() == [1.3, 5.0, 0.06]
    plain = inserted.copy()
    plain.run(MOVES)
    assert np.allclose(Response(inserted, MOVES, BY, ["shape"]).numbers([1.3, 5.0, 0.06])[0], plain.positions_mm.ravel(), atol=1e-9)


def test_gradients_refuse_what_cannot_be_differentiated(inserted, jumping):
    for arguments, words in (
        ((MOVES, ["hand"], OF), "stands for two"),
        ((MOVES, ["rest[0]"], OF), "rest"),
        ((MOVES, ["EI[0]", "EI[0]"], OF), "each parameter once"),
        ((MOVES, [], OF), "one or more"),
        ((MOVES, BY, ["tips"]), "of = 'tips': must be one of 'tip'"),
        ((MOVES[0], BY, OF), r"moves = .*: must have the shape \(n, 1, 2\)"),
        ((MOVES, BY, OF, "zero"), "across_jumps = 'zero'"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            Response(inserted, *arguments)
    with pytest.raises(endowire.InputError, match=r"must have the shape \(3,\)"):
        Response(inserted, MOVES, BY, OF).numbers([1.0])
    simulation, turn = jumping
    with pytest.raises(endowire.ComputationError, match="jump|snap"):
        Response(simulation, turn, ["rotate"], ["tip"]).linear([1.0])
    told = Response(simulation, turn, ["rotate"], ["tip"], across_jumps="nan")
    with pytest.warns(RuntimeWarning, match=r"derivatives by \['rotate'\] are NaN"):
        found, slopes = told.linear([1.0])
    assert np.isnan(slopes[0]).all() and slopes[0].shape == (3, 1)
    assert np.array_equal(found[0], told.numbers([1.0])[0]) and np.isfinite(found[0]).all()


@pytest.fixture
def not_loaded():
    """Layers are loaded anew in a test, and forgotten after it."""
    layers = ("endowire.torch", "endowire.jax")
    before = {name: sys.modules.pop(name) for name in layers if name in sys.modules}
    yield
    for name in layers:
        sys.modules.pop(name, None)
    sys.modules.update(before)


@pytest.mark.parametrize("name", ["torch", "jax"])
@pytest.mark.usefixtures("not_loaded")
def test_a_library_that_is_missing_is_named(name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=f"endowire.{name} needs .*: pip install {name}"):
        importlib.import_module(f"endowire.{name}")


class Tensor:
    """What the layer of PyTorch asks of a tensor."""

    device = "cpu"

    def __init__(self, values, requires_grad=False, **like):
        self.values, self.requires_grad = np.asarray(getattr(values, "values", values), dtype=float), requires_grad
        self.dtype = like.get("dtype", "float64")

    def detach(self):
        return self

    cpu = double = detach

    def numpy(self):
        return self.values

    def __matmul__(self, other):
        return Tensor(self.values @ other.values)

    def __add__(self, other):
        return Tensor(self.values + getattr(other, "values", other))

    __radd__ = __add__


class Context:
    def save_for_backward(self, *saved):
        self.saved_tensors = saved


def fake_torch():
    """A module that has of torch what the layer uses; `apply` remembers the context for `backward`."""

    class Function:
        @classmethod
        def apply(cls, *given):
            cls.last = Context()
            return cls.forward(cls.last, *given)

    torch, autograd, function = (types.ModuleType(name) for name in ("torch", "torch.autograd", "torch.autograd.function"))
    function.once_differentiable = lambda of: of
    torch.tensor, torch.autograd, autograd.Function, autograd.function = Tensor, autograd, Function, function
    return {"torch": torch, "torch.autograd": autograd, "torch.autograd.function": function}


@pytest.mark.usefixtures("not_loaded")
def test_the_layer_of_torch_gives_numbers_and_products(inserted, monkeypatch):
    for name, module in fake_torch().items():
        monkeypatch.setitem(sys.modules, name, module)
    layer = importlib.import_module("endowire.torch")
    response = Response(inserted, MOVES, BY, OF)
    respond = layer.function(inserted, MOVES, BY, OF)
    told = respond(Tensor(response.start, requires_grad=True))
    found, slopes = response.linear(response.start)
    assert all(np.array_equal(one.values, as_is) for one, as_is in zip(told, found, strict=True))
    weights = [np.arange(1.0, 1.0 + len(one)) for one in found]
    back, nothing = layer._Respond.backward(layer._Respond.last, *(Tensor(one) for one in weights))
    assert nothing is None
    assert back.values == pytest.approx(sum(one @ slope for one, slope in zip(weights, slopes, strict=True)))
    # Where nothing is differentiated, it is only run.
    alone = layer.function(inserted, MOVES, BY, "tip")(Tensor(response.start))
    assert np.allclose(alone.values, found[0]) and not hasattr(layer._Respond.last, "saved_tensors")


def test_torch_differentiates_through_it(inserted, jumping):
    torch = pytest.importorskip("torch")
    from endowire.torch import function

    respond = function(inserted, MOVES, BY, OF)
    at = torch.tensor([1.4, 5.0, 0.06], dtype=torch.float64, requires_grad=True)
    tip, push = respond(at)
    assert tip.shape == (3,) and push.shape == (1,) and tip.dtype == torch.float64
    (tip[0] * 2.0 + 100.0 * push[0]).backward()
    _, slopes = Response(inserted, MOVES, BY, OF).linear(at.detach().numpy())
    assert at.grad.numpy() == pytest.approx(2.0 * slopes[0][0] + 100.0 * slopes[1][0])
    # The checker of the library itself, by the hand, where the way does not matter.
    by_hand = function(inserted, MOVES, ["advance"], "tip")
    assert torch.autograd.gradcheck(by_hand, torch.tensor([1.4], dtype=torch.float64, requires_grad=True), eps=1e-5, atol=1e-4)
    single = function(inserted, MOVES, ["EI[0]"], "tip")(torch.tensor([5.0]))
    assert single.dtype == torch.float32 and not single.requires_grad
    # Some steps down a slope: the tip comes nearer to a place.
    values = torch.tensor([1.3], dtype=torch.float64, requires_grad=True)
    optimiser, offs = torch.optim.SGD([values], lr=0.3), []
    place = by_hand(torch.tensor([2.0], dtype=torch.float64))
    for _ in range(6):
        optimiser.zero_grad()
        off = ((by_hand(values) - place) ** 2).sum()
        off.backward()
        optimiser.step()
        offs.append(off.item())
    assert offs[-1] < 0.01 * offs[0]
    simulation, turn = jumping
    with pytest.raises(endowire.ComputationError):
        function(simulation, turn, ["rotate"], "tip")(torch.tensor([1.0], dtype=torch.float64, requires_grad=True))


def test_jax_differentiates_through_it(inserted, jumping):
    jax = pytest.importorskip("jax")
    from endowire.jax import function

    with jax.enable_x64(True):
        respond = function(inserted, MOVES, BY, OF)
        at = np.array([1.4, 5.0, 0.06])
        found, slopes = Response(inserted, MOVES, BY, OF).linear(at)

        def loss(values):
            tip, push = respond(values)
            return 2.0 * tip[0] + 100.0 * push[0]

        expected = 2.0 * slopes[0][0] + 100.0 * slopes[1][0]
        assert np.asarray(respond(at)[0]) == pytest.approx(found[0])
        assert np.asarray(jax.grad(loss)(at)) == pytest.approx(expected)
        assert np.asarray(jax.jit(jax.grad(loss))(at)) == pytest.approx(expected)
        assert np.asarray(jax.jacrev(lambda values: respond(values)[0])(at)) == pytest.approx(slopes[0])
        many = jax.vmap(lambda values: respond(values)[0])(np.stack([at, at]))
        assert np.asarray(many) == pytest.approx(np.stack([found[0]] * 2))
        simulation, turn = jumping
        with pytest.raises(endowire.ComputationError):
            jax.grad(lambda values: function(simulation, turn, ["rotate"], "tip")(values)[0])(np.array([1.0]))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            of_nan = function(simulation, turn, ["rotate"], "tip", across_jumps="nan")
            assert np.isnan(jax.grad(lambda values: of_nan(values)[0])(np.array([1.0]))).all()
