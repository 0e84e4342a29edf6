import ast
import subprocess
import sys
from pathlib import Path

import endowire


def test_stubs_name_everything():
    stub = ast.parse((Path(endowire.__file__).parent / "_endowire.pyi").read_text())
    native = endowire._endowire
    told = {node.name: node for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert set(told) == {name for name in vars(native) if not name.startswith("_")}
    for name, node in told.items():
        if isinstance(node, ast.ClassDef):
            methods = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
            public = {m for m in vars(getattr(native, name)) if not m.startswith("_")}
            assert {m for m in methods if not m.startswith("_")} == public, name
            assert all(getattr(getattr(native, name), m).__doc__ for m in public), name
        assert getattr(native, name).__doc__


def test_import_is_quick():
    code = "import time; t = time.perf_counter(); import endowire; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(3)]
    assert min(times) < 0.1
