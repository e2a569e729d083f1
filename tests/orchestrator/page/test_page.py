"""The page of a run: offline, of any run, the same bytes for the same run, safe from names."""

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import orchestrator.page
from orchestrator.cli import main
from orchestrator.page.curves import thinned
from orchestrator.page.page import SCRIPTS, make_page
from orchestrator.recording import Recording

VENDOR = Path(orchestrator.page.__file__).parent / "vendor"
MOST_LINES = 400


def data_of(page: Path) -> dict[str, Any]:
    """What the scripts of a page read."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.read_text())
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


@pytest.fixture
def run(scenario_file: Path, tmp_path: Path) -> Path:
    """A run of two components, without a report."""
    out = tmp_path / "run"
    assert main(["run", str(scenario_file), "--out", str(out), "--quiet", "--json"]) == 0
    return out


def test_a_run_ends_with_its_page_which_needs_nothing_from_elsewhere(run: Path) -> None:
    text = (run / "index.html").read_text()
    assert "default-src 'none'" in text
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", text)
    assert len(text) < 200_000


def test_a_page_says_what_was_run_and_how_to_run_it_again(run: Path, scenario_file: Path) -> None:
    data = data_of(run / "index.html")
    assert data["about"]["command"] == f"nlosim run {scenario_file}"
    assert data["about"]["status"] == "done"
    assert [each["name"] for each in data["wiring"]["components"]] == ["car", "base"]
    assert data["span"] == 1.0


@pytest.mark.parametrize("option", ["--no-page", "--no-figure"])
def test_nobody_gets_a_page_who_wants_none(
    option: str, scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["run", str(scenario_file), "--out", str(out), "--quiet", "--json", option]) == 0
    assert json.loads(capsys.readouterr().out)["page"] is None
    assert not (out / "index.html").exists()


def test_report_makes_the_same_bytes_again(run: Path) -> None:
    before = (run / "index.html").read_bytes()
    (run / "index.html").unlink()
    assert main(["report", str(run)]) == 0
    assert (run / "index.html").read_bytes() == before


def test_a_name_cannot_end_the_script_that_it_stands_in(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text())
    evil = "</script><script>alert(1)</script><!--\u2028&"
    manifest["scenario"]["title"] = evil
    manifest["scenario"]["components"][evil] = {"type": evil, "step": "1 s"}
    (run / "manifest.json").write_text(json.dumps(manifest))
    page = make_page(run)
    assert "alert(1)" not in re.sub(r"\\u003c.*?alert\(1\)|&gt;alert\(1\)", "", page.read_text())
    assert data_of(page)["about"]["title"] == evil


def test_the_libraries_are_those_that_were_published() -> None:
    said = (VENDOR / "README.md").read_text()
    for name in ("uplot.js", "uplot.css"):
        assert hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() in said
    assert "(v1.6.32)" in (VENDOR / "uplot.js").read_text()


def test_every_page_has_the_licences_of_its_libraries(run: Path) -> None:
    licence = (VENDOR / "uplot.license.txt").read_text().strip()
    assert licence in (run / "index.html").read_text()


def test_every_single_number_has_a_curve(run: Path) -> None:
    data = data_of(run / "index.html")
    recording = Recording(run)
    single = {name for name in recording.signals if recording.kind(name).endswith("[]")}
    assert single
    assert single <= {curve["name"] for curve in data["curves"]}
    assert data["not_here"] == []
    assert not data["thinned"]


def test_a_long_curve_keeps_its_peaks() -> None:
    """The least and the greatest of each part, the first and the last one."""
    values = np.sin(np.arange(10_000) / 7.0)
    values[4321], values[1234] = 9.0, -9.0
    kept = thinned(values, 100)
    assert len(kept) <= 202
    assert {0, 1234, 4321, 9999} <= set(kept.tolist())
    assert (np.diff(kept) > 0).all()
    assert thinned(values[:200], 100).tolist() == list(range(200))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_are_short_and_set_names_as_text_only(script: Path) -> None:
    text = script.read_text()
    assert len(text.splitlines()) < MOST_LINES
    assert not re.findall(r"innerHTML|outerHTML|insertAdjacent|document\.write|eval\(", text)
