"""Other optimisers on the evaluator, and the notebook: the bench record was made with a gain of 250 1/s and a delay of 4.7 ms."""

import importlib.util
import pathlib
import re
import shutil

import numpy as np
import pytest

EXAMPLES = pathlib.Path(__file__).parent.parent / "examples"


@pytest.mark.parametrize(
    "name, needs",
    [
        ("differential_evolution", "scipy"),
        ("evolution_strategy", "cma"),
        ("pypesto_problem", "pypesto"),
    ],
)
def test_an_optimiser_of_others_finds_the_valve(name, needs, bench):
    pytest.importorskip(needs)
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = module.main(bench)
    assert found["gain"] == pytest.approx(250, rel=0.01)
    assert found["delay"] == pytest.approx(0.0047, rel=0.02)


def test_the_readme_says_what_runs(bench, tmp_path, monkeypatch):
    text = (EXAMPLES.parent / "README.md").read_text()
    (tmp_path / "tests/data").mkdir(parents=True)
    shutil.copy(bench, tmp_path / "tests/data/bench.csv")
    monkeypatch.chdir(tmp_path)
    names = {"shares": np.full((3, 5), 0.5)}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(block, names)
    assert (names["report"].verdict, names["report"].effect_names) == ("found", ["delay"])
    assert (tmp_path / "result/report.html").is_file()
    assert names["costs"].shape == names["finished"].shape == (3,)


def test_the_notebook_runs(tmp_path):
    nbformat, client = (pytest.importorskip(name) for name in ("nbformat", "nbclient"))
    notebook = nbformat.read(EXAMPLES / "valve.ipynb", as_version=4)
    client.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    shown = [out for cell in notebook.cells for out in cell.get("outputs", [])]
    assert any("text/html" in out.get("data", {}) for out in shown)
    assert not any(out.output_type == "error" for out in shown)
