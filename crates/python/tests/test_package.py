import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import endowire

STUB = Path(endowire.__file__).parent / "_endowire.pyi"

ARRAYS = """
import numpy as np
import endowire

def push(simulation: endowire.Simulation, hand: endowire.Controller, vessel: endowire.Vessel) -> None:
    move = hand.next(simulation)
    if move is not None:
        simulation.step(move[:, 0], move[:, 1])
    simulation.step(np.float64(1.0), rotate_rad=[0.1])
    at = np.array(vessel.openings[0]["centre_mm"])
    endowire.Simulation(vessel, simulation.instruments, position_mm=at, direction=-at, friction=np.zeros(1))
"""


def test_stubs_name_everything():
    stub = ast.parse(STUB.read_text())
    native = endowire._endowire
    told = {node.name: node for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    told = {name: node for name, node in told.items() if not name.startswith("_")}
    assert set(told) == {name for name in vars(native) if not name.startswith("_")}
    for name, node in told.items():
        if isinstance(node, ast.ClassDef):
            methods = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
            public = {m for m in vars(getattr(native, name)) if not m.startswith("_")}
            assert {m for m in methods if not m.startswith("_")} == public, name
            copies = {"__copy__", "__deepcopy__"} & set(vars(getattr(native, name)))
            assert copies <= methods, name
            # None of them says that it may be a base, which is bit 10 of its flags.
            assert ["final"] == [item.id for item in node.decorator_list], name
            assert not getattr(native, name).__flags__ & 1 << 10, name
            assert all(getattr(getattr(native, name), m).__doc__ for m in public), name
        assert getattr(native, name).__doc__


def test_stubs_have_the_signatures_of_what_runs():
    def compare(node, runs):
        told = node.args
        names = [arg.arg for arg in (*told.posonlyargs, *told.args, *told.kwonlyargs)]
        ordered = dict(zip(names[: len(told.args)][::-1], told.defaults[::-1], strict=False))
        keywords = zip((arg.arg for arg in told.kwonlyargs), told.kw_defaults, strict=True)
        defaults = {**ordered, **{name: default for name, default in keywords if default is not None}}
        parameters = inspect.signature(runs).parameters
        of_runtime = {n: p.default for n, p in parameters.items() if p.default is not inspect.Parameter.empty}
        assert {n: ast.literal_eval(default) for n, default in defaults.items()} == of_runtime, node.name
        assert [n for n in names if n not in ("self", "cls")] == [n for n in parameters if n != "self"]

    for node in ast.parse(STUB.read_text()).body:
        runs = getattr(endowire._endowire, getattr(node, "name", ""), None)
        if isinstance(node, ast.FunctionDef):
            compare(node, runs)
        for item in getattr(node, "body", []) if isinstance(node, ast.ClassDef) else []:
            decorators = [decorator.id for decorator in item.decorator_list]
            if item.name == "__new__":
                compare(item, runs)
            elif "property" not in decorators and not item.name.startswith("_"):
                compare(item, getattr(runs, item.name))


def test_arrays_are_taken_by_the_stubs_where_they_are_taken(tmp_path, monkeypatch):
    api = pytest.importorskip("mypy.api")
    monkeypatch.setenv("MYPYPATH", str(STUB.parents[1]))
    (tmp_path / "arrays.py").write_text(ARRAYS)
    options = ["--strict", "--follow-imports=silent", f"--cache-dir={tmp_path / 'cache'}"]
    told, _, code = api.run([*options, str(tmp_path / "arrays.py")])
    assert code == 0, told


def test_import_is_quick():
    code = "import time; t = time.perf_counter(); import endowire; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(3)]
    assert min(times) < 0.1
