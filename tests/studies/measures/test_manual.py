"""What docs/measures.md shows is what happens."""

import re
from pathlib import Path

import pytest

from orchestrator.cli import main

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_results_are_in_pandas_as_the_manual_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The programs of the manual, after runs of the scenarios that they read."""
    pytest.importorskip("pandas", reason="data frames need pandas")
    monkeypatch.chdir(tmp_path)
    for name, stop in (("city", "1 s"), ("red_light", "0.5 s")):
        out = f"runs/{name.partition('_')[0]}"
        arguments = ["run", name, "--set", f"time.stop={stop}", "--quiet", "--no-figure"]
        assert main([*arguments, "--out", out]) == 0
    text = (ROOT / "docs" / "measures.md").read_text(encoding="utf-8")
    programs = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    assert len(programs) == 2
    capsys.readouterr()
    for program in programs:
        exec(program, {"__name__": "manual"})  # noqa: S102 - it is ours
    printed = capsys.readouterr().out
    assert "from_m" in printed
    assert "m/s" in printed
