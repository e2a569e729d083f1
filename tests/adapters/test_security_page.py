"""The page on security shows what the command prints, and names tests that exist."""

import re
from pathlib import Path

import pytest

pytest.importorskip("cryptography", reason="cryptography is not installed")

from orchestrator.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
DATE = re.compile(r"\d{4}-\d\d-\d\d")


def test_the_page_shows_what_the_command_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = re.search(r"^```\n\$ nlosim (keys [^\n]*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert shown is not None
    monkeypatch.chdir(tmp_path)
    Path("hosts.yaml").write_text(
        'credentials: keys\nhosts:\n  gpu: {endpoint: "tls/10.0.0.3:7447"}\n'
    )
    assert main(shown[1].split()) == 0
    printed = capsys.readouterr().out.replace(str(tmp_path), "/home/me/study")
    assert DATE.sub("DATE", printed) == DATE.sub("DATE", shown[2])


def test_the_tests_that_the_page_names_exist() -> None:
    named = re.findall(r"`(tests/[a-z_/]+\.py)`", PAGE)
    assert len(named) == 6
    assert all((ROOT / name).is_file() for name in named)
