"""The tutorial runs, its notebook is made of it, and everything public is told of in the reference."""

import inspect
import json
import runpy
from pathlib import Path

import pytest

import endowire
import endowire.gym

EXAMPLES = Path(__file__).parents[1] / "examples"


def cells(script):
    """The cells of a script: whether each is text, and what is in it."""
    found = []
    for part in ("\n" + script).split("\n# %%")[1:]:
        head, _, body = part.partition("\n")
        is_text = head.strip() == "[markdown]"
        lines = body.strip("\n").split("\n")
        if is_text:
            lines = [line.removeprefix("#").removeprefix(" ") for line in lines]
        found.append((is_text, "\n".join(lines)))
    return found


def test_the_tutorial_runs(monkeypatch, capsys):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg", force=True)
    figures = []
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: figures.append(matplotlib.pyplot.gcf()))
    runpy.run_path(str(EXAMPLES / "tutorial.py"))
    assert len(figures) == 3 and all(figure.axes for figure in figures)
    assert "follows the path arrives in" in capsys.readouterr().out


def test_the_notebook_is_made_of_the_script():
    script = cells((EXAMPLES / "tutorial.py").read_text())
    notebook = json.loads((EXAMPLES / "tutorial.ipynb").read_text())["cells"]
    assert [(cell["cell_type"] == "markdown", "".join(cell["source"])) for cell in notebook] == script
    # With what came out when it was made.
    assert (
        sum("image/png" in output.get("data", {}) for cell in notebook for output in cell.get("outputs", []))
        == 3
    )


def public():
    """What a user of the package meets, by name."""
    for module in (endowire, endowire.gym):
        yield module.__name__, module
        for name in module.__all__:
            thing = getattr(module, name)
            yield f"{module.__name__}.{name}", thing
            if inspect.isclass(thing) and thing.__module__.startswith("endowire"):
                for member, value in vars(thing).items():
                    if not member.startswith("_") and (callable(value) or inspect.isdatadescriptor(value)):
                        yield f"{module.__name__}.{name}.{member}", value


def test_everything_public_says_what_it_is():
    all_of_it = dict(public())
    silent = [name for name, thing in all_of_it.items() if not inspect.getdoc(thing)]
    assert not silent, silent
    assert {"endowire.Vessel.generate", "endowire.StepReport.push_force_n"} <= all_of_it.keys()


def test_the_reference_is_built_from_docstrings(tmp_path):
    pdoc = pytest.importorskip("pdoc")
    pdoc.pdoc("endowire", "endowire.gym", "endowire.gym.tasks", output_directory=tmp_path)
    page = (tmp_path / "endowire.html").read_text()
    assert all(
        f'id="{name}"' in page for name in ("Vessel.generate", "Simulation.step", "Batch.step", "sweep")
    )
    assert 'id="arch_variety"' in (tmp_path / "endowire/gym/tasks.html").read_text()
