"""Builds programs in which a unit's allocations can be made to fail; see native/starving.h."""

import subprocess
import sys
from pathlib import Path

from fmus.native.build import COMMON, fmi_headers, instantiation_token, load_unit
from fmus.native.c_table import variables_header, variables_source
from fmus.native.targets import zig_environment

_NATIVE = Path(__file__).parent / "native"
_ALLOCATORS = ("malloc", "calloc", "realloc", "free")


def build_program(unit_name: str, driver: Path, folder: Path) -> Path:
    """The driver and the unit in one program, which stops at undefined behaviour.

    That is Zig's default for C. The processor's newest instructions are unknown to valgrind, and
    left out.
    """
    unit = load_unit(unit_name)
    (folder / "variables.h").write_text(variables_header(unit.interface))
    table = variables_source(unit.interface, instantiation_token(unit))
    (folder / "variables.c").write_text(table)
    (folder / "declarations.h").write_text(
        "#include <stdlib.h>\n"
        "void *test_malloc(size_t);\nvoid *test_calloc(size_t, size_t);\n"
        "void *test_realloc(void *, size_t);\nvoid test_free(void *);\n"
        + "".join(f"#define {name} test_{name}\n" for name in _ALLOCATORS)
    )
    compiler = [sys.executable, "-m", "ziglang", "cc", "-std=c11", "-O1", "-g", "-mcpu=baseline"]
    folders = [folder, COMMON, unit.folder, _NATIVE]
    include = [argument for path in folders for argument in ("-I", str(path))]
    include += ["-isystem", str(fmi_headers())]
    objects = []
    for source in (*unit.sources(), folder / "variables.c"):
        objects.append(str(folder / f"{Path(source).stem}.o"))
        starve = ["-include", str(folder / "declarations.h")]
        _run([*compiler, *include, *starve, "-c", str(source), "-o", objects[-1]])
    program = folder / driver.stem
    _run([*compiler, *include, str(driver), *objects, "-lm", "-o", str(program)])
    return program


def _run(command: list[str]) -> None:
    subprocess.run(command, check=True, env=zig_environment())
