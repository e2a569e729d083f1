"""Programs in which a unit's allocations can be made to fail; see native/starving.h."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from fmus.native.targets import zig_environment
from fmus.native.unit import SHELL, fmi_headers, load_unit

NEEDS_VALGRIND: Final = pytest.mark.skipif(
    shutil.which("valgrind") is None, reason="valgrind is not installed"
)
_NATIVE = Path(__file__).parent / "native"
_STARVED = [f"-D{name}=test_{name}" for name in ("malloc", "calloc", "realloc", "free")]


def build_program(unit_name: str, driver: Path, folder: Path) -> Path:
    """The driver and the unit in one program, which stops at undefined behaviour.

    That is Zig's default for C. The processor's newest instructions are unknown to valgrind, and
    left out.
    """
    unit = load_unit(unit_name)
    unit.write_generated(folder)
    compiler = [sys.executable, "-m", "ziglang", "cc", "-std=c11", "-O1", "-g", "-mcpu=baseline"]
    folders = [folder, SHELL, unit.folder, _NATIVE]
    include = [argument for path in folders for argument in ("-I", str(path))]
    include += ["-isystem", str(fmi_headers())]
    objects = []
    for source in (*unit.sources(), folder / "variables.c"):
        objects.append(str(folder / f"{Path(source).stem}.o"))
        _run([*compiler, *include, *_STARVED, "-c", str(source), "-o", objects[-1]])
    program = folder / driver.stem
    _run([*compiler, *include, str(driver), *objects, "-lm", "-lpthread", "-o", str(program)])
    return program


def run(*command: str | Path) -> str:
    """What a command that must succeed printed."""
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return answer.stdout


def run_starved(program: Path, *arguments: str) -> None:
    """Let one allocation of a program of `build_program` after the other fail."""
    assert "0 failures with all of them" in run(program, "starved", *arguments)


def run_in_valgrind(program: Path, *arguments: str) -> None:
    """Let valgrind look for what was never written, and for leaks."""
    checks = ["--quiet", "--error-exitcode=9", "--leak-check=full"]
    run("valgrind", *checks, program, *arguments)


def _run(command: list[str]) -> None:
    subprocess.run(command, check=True, env=zig_environment())
