"""`make audit`: what could not be checked never looks like a clean result."""

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from audit import CANARY, main

CLEAN = {"name": "numpy", "version": "2.0", "vulns": []}
BAD = {
    "name": "lxml",
    "version": "5.0",
    "vulns": [{"id": "PYSEC-1", "aliases": ["CVE-1"], "fix_versions": ["5.1"]}],
}
UNKNOWN = {"name": "nlosim", "skip_reason": "not found"}
SICK = {"name": "pyyaml", "version": "5.3", "vulns": [{"id": "CVE-2020-14343"}]}


class Service:
    """Says what it is told to; of the canary by itself."""

    def __init__(self, canary: object, *packages: object) -> None:
        self.canary, self.packages = canary, packages

    def __call__(self, words: Sequence[str]) -> subprocess.CompletedProcess[str]:
        if "--requirement" in words:
            text = Path(words[-1]).read_text()
            assert text == f"{CANARY}\n"
            found: Sequence[object] = [self.canary]
        else:
            assert words[-2] == "--path"
            found = self.packages
        said = json.dumps({"dependencies": found, "fixes": []})
        return subprocess.CompletedProcess(words, 0, said, "")


def unreachable(words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.CompletedProcess(words, 1, "", "Traceback\nConnectionError: no route\n")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "numpy-2.0.dist-info").mkdir()
    return tmp_path


def test_vulnerabilities_are_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(folder)], Service(SICK, CLEAN, BAD, UNKNOWN)) == 1
    assert capsys.readouterr().out.splitlines() == [
        "lxml 5.0: PYSEC-1, CVE-1; fixed in 5.1",
        "not checked: nlosim: not found",
        "2 packages, 1 known vulnerabilities",
    ]
    assert main([str(folder)], Service(SICK, CLEAN, UNKNOWN)) == 0


@pytest.mark.parametrize(
    ("service", "why"),
    [
        (unreachable, "pip-audit fails: ConnectionError: no route"),
        (Service({**SICK, "vulns": []}, CLEAN), f"knows of no vulnerability of {CANARY}"),
        (Service({"name": "pyyaml", "skip_reason": "?"}, CLEAN), "knows of no vulnerability"),
        (Service(SICK, UNKNOWN), "the service knows none of the packages"),
    ],
)
def test_who_could_not_be_asked_is_no_clean_result(
    service: Service, why: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(folder)], service) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: nothing was checked: ")
    assert why in said


def test_a_folder_without_packages_is_no_clean_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path)], Service(SICK, CLEAN)) == 2
    assert "holds no packages" in capsys.readouterr().err
