"""Nothing leaks, nothing is read that was never written, and short memory is an error."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fmus.common.build import COMMON, fmi_headers, instantiation_token, load_unit
from fmus.common.c_table import variables_header, variables_source
from fmus.common.targets import zig_environment

DRIVER = Path(__file__).parent / "native" / "busy.c"
ALLOCATORS = ("malloc", "calloc", "realloc", "free")


@pytest.fixture(scope="session")
def busy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver and the unit in one program, which stops at undefined behaviour.

    That is Zig's default for C. The processor's newest instructions are unknown to valgrind.
    """
    folder = tmp_path_factory.mktemp("busy")
    unit = load_unit("channel")
    (folder / "variables.h").write_text(variables_header(unit.interface))
    table = variables_source(unit.interface, instantiation_token(unit))
    (folder / "variables.c").write_text(table)
    (folder / "declarations.h").write_text(
        "#include <stdlib.h>\n"
        "void *test_malloc(size_t);\nvoid *test_calloc(size_t, size_t);\n"
        "void *test_realloc(void *, size_t);\nvoid test_free(void *);\n"
        + "".join(f"#define {name} test_{name}\n" for name in ALLOCATORS)
    )
    compiler = [sys.executable, "-m", "ziglang", "cc", "-std=c11", "-O1", "-g", "-mcpu=baseline"]
    include = ["-I", str(folder), "-I", str(COMMON), "-isystem", str(fmi_headers())]
    program = folder / "busy"
    sources = [*map(str, unit.sources()), str(folder / "variables.c")]
    objects = []
    for source in sources:
        objects.append(str(folder / f"{Path(source).stem}.o"))
        starve = ["-include", str(folder / "declarations.h"), "-I", str(unit.folder)]
        _run([*compiler, *include, *starve, "-c", source, "-o", objects[-1]])
    _run([*compiler, *include, str(DRIVER), *objects, "-lm", "-o", str(program)])
    return program


def _run(command: list[str]) -> None:
    subprocess.run(command, check=True, env=zig_environment())


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
