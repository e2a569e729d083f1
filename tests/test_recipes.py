"""docs/recipes.md and its notebook are true: they run, and agree with the measures."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.cli import main

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "recipes.md"
NOTEBOOK = ROOT / "docs" / "examples" / "run_to_prr.ipynb"

pytest.importorskip("xarray")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the page's command was given; the run is shortened."""
    path = tmp_path_factory.mktemp("recipes")
    (line,) = re.findall(r"```sh\nnlosim (.*)\n```", PAGE.read_text())
    words = line.replace("--out ", f"--out {path}/").split()
    measures = "measures={prr: {}, pir: {}, aoi: {}, cbr: {}}"
    short = ["--set", "time.stop=2 s", "--set", measures, "--quiet"]
    assert main([*words, *short]) == 0
    return path


def run_blocks(texts: list[str], folder: Path) -> dict[str, Any]:
    """The names after `texts` were executed in order in `folder`."""
    names: dict[str, Any] = {"__name__": "recipes"}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for number, text in enumerate(texts):
            exec(compile(text, f"block {number}", "exec"), names)  # noqa: S102 - our own manual
    return names


@pytest.fixture(scope="module")
def names(folder: Path) -> dict[str, Any]:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 12
    return run_blocks(blocks, folder)


def measured(folder: Path, name: str) -> pd.DataFrame:
    return pd.read_csv(folder / "runs" / "red_light-1" / "measures" / f"{name}.csv")


def test_prr_over_distance_is_that_of_the_measure(names: dict[str, Any], folder: Path) -> None:
    table = measured(folder, "prr-distance")
    for link in ("all", "LOS", "NLOSv", "NLOSb"):
        found = names["prr_of_all"] if link == "all" else names["prr"][link]
        expected = table[table["link"] == link]["prr"].to_numpy()
        assert len(found) == len(expected) == 25
        np.testing.assert_allclose(found.to_numpy(), expected, rtol=1e-12)


def test_gaps_are_those_of_the_measure(names: dict[str, Any], folder: Path) -> None:
    numbers = json.loads((folder / "runs/red_light-1/metrics.json").read_text())["measures"]["pir"]
    assert names["gaps"].mean() * 1e3 == pytest.approx(numbers["pir_mean_ms"], rel=0.02)
    assert names["counts"].sum() > 0.9 * len(names["gaps"])


def test_the_age_is_at_least_half_of_the_gaps(names: dict[str, Any]) -> None:
    """Of gaps all alike it is half of one, and the delay; unequal ones make it larger."""
    mean_gap = (
        names["gaps"].groupby([names["heard"]["transmitter"], names["heard"]["receiver"]]).mean()
    )
    both = pd.concat([names["age"], mean_gap], axis=1, join="inner").to_numpy()
    assert len(both) > 1000
    assert (both[:, 0] >= both[:, 1] / 2).all()
    assert np.median(both[:, 0] / both[:, 1]) < 1.0


def test_the_channel_is_as_busy_as_the_measure_says(names: dict[str, Any], folder: Path) -> None:
    numbers = json.loads((folder / "runs/red_light-1/metrics.json").read_text())["measures"]["cbr"]
    mean = float(names["over_time"].sel(time=slice(0.2, None)).mean())
    assert mean == pytest.approx(numbers["cbr_mean"], rel=0.1)


def test_fates_are_shares(names: dict[str, Any]) -> None:
    fates = names["fates"]
    np.testing.assert_allclose(fates.sum(axis=1), 1.0)
    expected = names["prr_of_all"].dropna()
    np.testing.assert_allclose(fates["received"], expected[fates.index], rtol=1e-12)


def test_obstacles_take_power_and_messages_take_time(names: dict[str, Any]) -> None:
    taken = names["taken"].dropna()
    assert len(taken) >= 3
    assert taken.median() > 10.0  # a house
    assert names["delay"].min() > 2e-4  # 200 bytes at 6 Mbit/s
    assert names["percentiles"].is_monotonic_increasing


def test_neighbours_are_known_and_the_load_is_what_was_sent(names: dict[str, Any]) -> None:
    awareness = names["awareness"]
    assert len(awareness) == 2
    assert ((awareness > 0.2) & (awareness <= 1.0)).all()
    total = names["packets"]["size"].sum() / names["vehicles"]["time"].max()
    assert names["load"].sum() == pytest.approx(total)
    assert len(names["busiest"]) == 5


def test_the_ego_drives_as_far_as_its_speed_says(names: dict[str, Any]) -> None:
    drive = names["drive"]
    assert names["driven"] == pytest.approx(np.trapezoid(drive["ego.speed"], drive.index), rel=0.01)
    assert names["closest"][0] == drive["ego.gap"].min()


def test_the_notebook_runs_and_finds_the_same(names: dict[str, Any], folder: Path) -> None:
    notebook = json.loads(NOTEBOOK.read_text())
    assert notebook["nbformat"] == 4
    cells = notebook["cells"]
    assert not any(cell.get("outputs") for cell in cells)
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    found = run_blocks(["import matplotlib\nmatplotlib.use('Agg')", *code], folder)
    np.testing.assert_array_equal(found["prr"].to_numpy(), names["prr_of_all"].to_numpy())
    assert len(found["figure"].axes) == 3
    assert all(axes.lines or axes.patches for axes in found["figure"].axes)
    assert (folder / "run.png").stat().st_size > 10_000
    found["plt"].close("all")
