"""`nlosim fmu build`."""

from pathlib import Path

from adapters.fmu_command import add_command
from orchestrator.cli.outcome import Exit, Outcome
from tests.commands import executed

LAG = Path(__file__).parent.parent / "units" / "lag"


def execute(*words: str) -> Outcome:
    return executed(add_command, "fmu", *words)


def test_build_reports_what_it_made_and_what_it_kept(tmp_path: Path) -> None:
    words = ("build", str(LAG), "--target", "host", "--out", str(tmp_path))
    first, second = execute(*words), execute(*words)
    assert (tmp_path / "lag.fmu").is_file()
    assert [row["new"] for row in first.data["fmus"]] == [True]
    assert [row["new"] for row in second.data["fmus"]] == [False]
    assert second.text == f"{tmp_path / 'lag.fmu'}: up to date"


def test_build_says_what_is_wrong(tmp_path: Path) -> None:
    outcome = execute("build", str(tmp_path / "none"))
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert "there is no unit" in outcome.text
