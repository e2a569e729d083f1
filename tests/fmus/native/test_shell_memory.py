"""The shell when memory is short: errors, no crash, no leak."""

import subprocess
from pathlib import Path

from tests.fmus.starving import build_program

HERE = Path(__file__).parent


def test_every_allocation_may_fail(tmp_path: Path) -> None:
    unit = str(HERE.parent / "units" / "lag")
    program = build_program(unit, HERE / "starved.c", tmp_path)
    answer = subprocess.run([program], capture_output=True, text=True, check=False, timeout=60)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "0 failures with all of them" in answer.stdout
