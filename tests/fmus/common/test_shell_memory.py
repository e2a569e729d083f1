"""The shell when memory is short: errors, no crash, no leak."""

import subprocess
import sys
from pathlib import Path

from fmus.common.build import COMMON, SHELL_SOURCES, fmi_headers, instantiation_token, load_unit
from fmus.common.c_table import variables_header, variables_source
from fmus.common.targets import zig_environment

HERE = Path(__file__).parent
ALLOCATORS = ("malloc", "calloc", "realloc", "free")


def test_every_allocation_may_fail(tmp_path: Path) -> None:
    """Compiled with Zig's default for C, which stops the program at undefined behaviour."""
    unit = load_unit(str(HERE.parent / "units" / "lag"))
    (tmp_path / "variables.h").write_text(variables_header(unit.interface))
    table = variables_source(unit.interface, instantiation_token(unit))
    (tmp_path / "variables.c").write_text(table)
    compiler = [sys.executable, "-m", "ziglang", "cc", "-std=c11", "-O1", "-g"]
    include = ["-I", str(tmp_path), "-I", str(COMMON), "-isystem", str(fmi_headers())]
    declarations = tmp_path / "declarations.h"
    declarations.write_text(
        "#include <stdlib.h>\n"
        "void *test_malloc(size_t);\nvoid *test_calloc(size_t, size_t);\n"
        "void *test_realloc(void *, size_t);\nvoid test_free(void *);\n"
        + "".join(f"#define {name} test_{name}\n" for name in ALLOCATORS)
    )
    sources = [*(COMMON / name for name in SHELL_SOURCES), tmp_path / "variables.c"]
    sources.append(unit.folder / "lag.c")
    objects = []
    for source in sources:
        objects.append(tmp_path / f"{source.stem}.o")
        starve = ["-include", str(declarations), "-c", str(source), "-o", str(objects[-1])]
        subprocess.run([*compiler, *include, *starve], check=True, env=zig_environment())
    program = tmp_path / "starved"
    link = [str(HERE / "native" / "starved.c"), *map(str, objects), "-lm", "-o", str(program)]
    subprocess.run([*compiler, *include, *link], check=True, env=zig_environment())
    answer = subprocess.run([program], capture_output=True, text=True, check=False, timeout=60)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "0 failures with all of them" in answer.stdout
