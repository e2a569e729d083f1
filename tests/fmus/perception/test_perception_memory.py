"""Nothing leaks, nothing is read that was never written, and short memory is an error."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.fmus.starving import build_program


@pytest.fixture(scope="module")
def sighted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver and the unit in one program, which stops at undefined behaviour."""
    driver = Path(__file__).parent / "native" / "sighted.c"
    return build_program("perception", driver, tmp_path_factory.mktemp("sighted"))


def run(*command: str | Path) -> str:
    """What a command that must succeed printed."""
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return answer.stdout


def test_a_life_without_undefined_behaviour(sighted: Path) -> None:
    zones, sharers, failures, differences = map(int, re.findall(r"\d+", run(sighted)))
    assert zones > 10
    assert sharers >= 2
    assert (failures, differences) == (0, 0)


def test_every_allocation_may_fail(sighted: Path) -> None:
    assert "0 failures with all of them" in run(sighted, "starved")


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
@pytest.mark.parametrize("arguments", [[], ["starved"]])
def test_valgrind_finds_no_error_and_no_leak(sighted: Path, arguments: list[str]) -> None:
    checks = ["--quiet", "--error-exitcode=9", "--leak-check=full"]
    run("valgrind", *checks, sighted, *arguments)
