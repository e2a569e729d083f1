"""`nlosim verify channel`."""

import re
import shutil
from pathlib import Path

import pytest

from orchestrator import registry
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.parameters import ComponentType
from studies.verification.channel.command import add_unit
from tests.commands import executed

from .golden_sample import GOLDEN, RUN, SEEDS, change_cell, write_text


@pytest.fixture(autouse=True)
def built_channel(channel_type: ComponentType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The channel as the sources make it is the one that is installed."""
    monkeypatch.setattr(registry, "component_type", {"channel": channel_type}.__getitem__)


def execute(*words: str) -> Outcome:
    return executed(add_unit, "channel", "--seeds", str(SEEDS), *words)


@pytest.mark.slow
def test_a_set_that_passes(golden: Path) -> None:
    shutil.rmtree(golden / "stack")
    outcome = execute("--golden", str(golden))
    assert outcome.exit_code is Exit.DONE
    assert outcome.data["pass"] is True
    assert outcome.text.splitlines()[0].split() == [
        "file", "cases", "largest", "error", "tolerance", "excepted", "mismatches", "misses",
    ]  # fmt: skip


@pytest.mark.slow
def test_a_set_that_does_not_pass(golden: Path) -> None:
    shutil.rmtree(golden / "stack")
    change_cell(golden / "pathloss.csv", "loss_db", lambda _: "1.0")
    outcome = execute("--golden", str(golden))
    assert outcome.exit_code is Exit.NOT_PASSED
    assert int(outcome.exit_code) == 1
    assert outcome.data["pass"] is False
    assert "error" not in outcome.data
    assert re.search(r"pathloss\.csv .* FAIL", outcome.text)


def test_malformed_data(golden: Path) -> None:
    write_text(golden / "min_sinr.json", "[")
    outcome = execute("--golden", str(golden))
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert outcome.text.startswith("min_sinr.json:1:2: ")
    assert outcome.data["error"]["problems"] == [outcome.text]


@pytest.mark.parametrize("seeds", ["9", "-20", "many"])
def test_too_few_seeds_are_refused(seeds: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        execute("--golden", str(GOLDEN), "--seeds", seeds)
    assert "must be 10 or more" in capsys.readouterr().err


@pytest.mark.slow
def test_the_page_shows_its_figures(tmp_path: Path) -> None:
    folder = tmp_path / "validation"
    outcome = execute("--golden", str(GOLDEN), "--figures", str(folder))
    page = tmp_path / "validation-channel.md"
    assert outcome.text.endswith(f"wrote {page}")
    shown = re.findall(r"\]\(validation/(.*?)\)", page.read_text())
    run = RUN.removeprefix("stack/")
    assert set(shown) == {path.name for path in folder.iterdir()}
    assert set(shown) == {
        "values.png", "errors.png", "error-rate.png", "fading.png", f"prr-{run}.png",
        "figures.json",
    }  # fmt: skip
    assert f"| {RUN} | 3784 |" in page.read_text()


@pytest.mark.slow
def test_the_same_results_make_the_same_bytes(golden: Path, tmp_path: Path) -> None:
    for path in [*golden.glob("*.csv"), *golden.glob("[bkm]*.json")]:
        path.unlink()
    written = []
    for name in ("first", "second"):
        folder = tmp_path / name / "validation"
        execute("--golden", str(golden), "--figures", str(folder))
        files = [path for path in folder.parent.rglob("*") if path.is_file()]
        written.append({path.name: path.read_bytes() for path in files})
    assert len(written[0]) == 5
    assert written[0] == written[1]
