"""The examples by task run, are short, and are those of the guide's table."""

import re
import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
GUIDE = Path(__file__).parents[3] / "docs" / "guide"
#: They have tests of their own, and are no short ones.
OTHERS = {"learn_arch", "shape_tip", "tutorial"}
NAMES = sorted({file.stem for file in EXAMPLES.glob("*.py")} - OTHERS)


@pytest.mark.parametrize("name", NAMES)
def test_an_example_runs(name, tmp_path, monkeypatch, capsys):
    file = EXAMPLES / f"{name}.py"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [str(file)])
    runpy.run_path(str(file), run_name="__main__")
    said = capsys.readouterr().out
    assert said and "nan" not in said.lower(), said


def test_examples_are_short_and_the_guide_has_them_all():
    lines = {name: (EXAMPLES / f"{name}.py").read_text().count("\n") for name in NAMES}
    assert len(NAMES) >= 14 and max(lines.values()) < 40, lines
    page = (GUIDE / "README.md").read_text()
    linked = re.findall(r"\]\(\.\./\.\./crates/python/examples/(\w+)\.py\)", page)
    assert sorted(linked) == NAMES
