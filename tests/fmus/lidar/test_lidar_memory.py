"""Nothing leaks, nothing is read that was never written, and short memory is an error."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.fmus.starving import build_program


@pytest.fixture(scope="module")
def scanning(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver and the unit in one program."""
    driver = Path(__file__).parent / "native" / "scanning.c"
    return build_program("lidar", driver, tmp_path_factory.mktemp("scanning"))


def test_a_life_without_undefined_behaviour(scanning: Path) -> None:
    answer = subprocess.run([scanning], capture_output=True, text=True, check=False, timeout=60)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    size, failures = map(int, re.findall(r"\d+", answer.stdout))
    assert size > 20_000
    assert failures == 0


def test_every_allocation_may_fail(scanning: Path) -> None:
    answer = subprocess.run(
        [scanning, "starved"], capture_output=True, text=True, check=False, timeout=120
    )
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "0 failures with all of them" in answer.stdout


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_valgrind_finds_no_error_and_no_leak(scanning: Path) -> None:
    command = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", str(scanning)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert answer.returncode == 0, answer.stdout + answer.stderr
