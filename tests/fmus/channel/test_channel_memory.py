"""Nothing leaks, nothing is read that was never written, and short memory is an error."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.fmus.starving import build_program


@pytest.fixture(scope="session")
def busy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver and the unit in one program."""
    driver = Path(__file__).parent / "native" / "busy.c"
    return build_program("channel", driver, tmp_path_factory.mktemp("busy"))


def test_a_busy_life_without_undefined_behaviour(busy: Path) -> None:
    answer = subprocess.run([busy], capture_output=True, text=True, check=False, timeout=60)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    numbers = [int(n) for n in re.findall(r"\d+", answer.stdout)]
    assert numbers[0] > 1000
    assert numbers[1] > 1000
    assert numbers[2:] == [0, 0]


def test_every_allocation_may_fail(busy: Path) -> None:
    answer = subprocess.run(
        [busy, "starved"], capture_output=True, text=True, check=False, timeout=120
    )
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "0 failures with all of them" in answer.stdout


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_valgrind_finds_no_error_and_no_leak(busy: Path) -> None:
    command = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", str(busy)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert answer.returncode == 0, answer.stdout + answer.stderr
