"""The manual is true: its examples run, its links lead somewhere, its words are known."""

import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from fmus.messages.records import LINKS
from fmus.native.build import build_fmu
from fmus.native.targets import select_targets
from fmus.native.unit import load_unit
from orchestrator.cli import main
from orchestrator.testing import check_component

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)


def test_the_coverage_map_shows_what_stands_in_the_way() -> None:
    """As docs/physics-channel.md draws it: free along the streets, dark behind the houses."""
    names: dict[str, Any] = {"__name__": "coverage"}
    (block,) = python_blocks(ROOT / "docs" / "physics-channel.md")
    exec(compile(block, "coverage.py", "exec"), names)  # noqa: S102 - our own manual
    x, y, success = names["x"], names["y"], names["success"]
    links = names["found"]["probe.link"].reshape(x.shape)
    assert (success[(x == 0) | (y == 0)] > 0.9).all()
    assert (success[(abs(x) > 80) & (abs(x) == abs(y))] < 0.1).all()
    behind_the_lorry = links[(y == 0) & (x > 40)]
    assert LINKS[behind_the_lorry[0]] == "NLOSv"
    assert LINKS[behind_the_lorry[-1]] == "LOS"


def test_the_example_unit_builds_and_multiplies(tmp_path: Path) -> None:
    """As docs/fmus.md shows it: an interface, a C file, an FMU, a component."""
    text = (ROOT / "docs" / "fmus.md").read_text()
    (table,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    source = re.findall(r"```c\n(.*?)```", text, re.DOTALL)[0]
    (tmp_path / "interface.py").write_text(table)
    (tmp_path / "gain.c").write_text(source)
    unit = load_unit(str(tmp_path))
    fmu = build_fmu(unit, tmp_path, targets=select_targets(["host"])).path
    component = FmuComponentType(fmu).create("gain", {"gain": 3.0})
    check_component(component, steps=3, h=100_000_000, seed=1)
    component.setup(0, np.random.default_rng(0))
    component.initialise({"u": np.zeros(0)})
    component.step({"u": np.array([1.0, -2.0])}, 0, 100_000_000)
    np.testing.assert_array_equal(component.outputs()["y"], [3.0, -6.0])
    component.close()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        if not target.startswith(("http://", "https://")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def commands() -> list[tuple[str, ...]]:
    """Every `nlosim` command on every page, without its comment; each once.

    Those of the tutorial that need its own files run in `test_tutorial.py`; those that go on with
    a scenario that they made before run in their order, see `scene_blocks`; likewise those of
    resuming.md, see `test_resuming_page.py`, of distribution.md, see `test_hosts_page.py`, and of
    experiment-page.md, see `orchestrator/page/test_experiment_page.py`.
    """
    found = {}
    for page in PAGES:
        for block in console_blocks(page):
            if MAKES_A_SCENARIO in block or page.name in OF_THEIR_OWN:
                continue
            for line in lines(block):
                if page.name == "tutorial.md" and "scenarios/" not in line:
                    continue
                found[tuple(shlex.split(line, comments=True))] = page
    return list(found)


MAKES_A_SCENARIO = "$ nlosim scene new "
OF_THEIR_OWN = ("resuming.md", "distribution.md", "rerun.md", "experiment-page.md")
"""Pages whose commands run in tests of their own."""


def console_blocks(page: Path) -> list[str]:
    return re.findall(r"```console\n(.*?)```", page.read_text(), re.DOTALL)


def lines(block: str) -> list[str]:
    """The `nlosim` commands of a block, without `nlosim`."""
    return re.findall(r"^\$ nlosim (.*)$", block, re.MULTILINE)


def scene_blocks() -> list[tuple[str, str]]:
    """Page and text of every block that makes a scenario of a scene."""
    return [
        (page.name, block)
        for page in PAGES
        if page.name != "tutorial.md"
        for block in console_blocks(page)
        if MAKES_A_SCENARIO in block
    ]


@pytest.mark.slow
@pytest.mark.parametrize("command", commands(), ids=" ".join)
def test_commands_of_the_manual_work(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the repository's root, as written; runs are shortened, and drawn once per scenario."""
    monkeypatch.chdir(ROOT)
    if command[0] == "run":
        quick = ["--no-figure"] if len(command) > len(("run", "SCENARIO")) else []
        command = (*command, *quick, "--set", "time.stop=200 ms", "--out", str(tmp_path / "run"))
    assert main(list(command)) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("page", "block"), scene_blocks(), ids=[p for p, _ in scene_blocks()])
def test_a_scene_becomes_a_scenario_a_picture_and_a_run(
    page: str, block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder that has the examples of the repository; runs are shortened."""
    del page
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    monkeypatch.chdir(tmp_path)
    for line in lines(block):
        words = shlex.split(line, comments=True)
        assert main([*words, *(["--set", "time.stop=1 s"] if words[0] == "run" else [])]) == 0
    assert list(tmp_path.glob("*.yaml"))
    assert all(picture.stat().st_size > 10_000 for picture in tmp_path.glob("*.png"))
    assert list(tmp_path.glob("runs/*/manifest.json"))
