"""records.h, compiled: C and NumPy lay out the records alike, and number alike what they name."""

import subprocess
import sys
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from fmus.messages import records
from fmus.native.c_records import BODIES, CONSTANTS, KINDS, STRUCTS, records_header
from fmus.native.targets import zig_environment

pytestmark = pytest.mark.slow

NUMBERS: Final = {
    **CONSTANTS,
    **KINDS,
    **BODIES,
    "BODY_CLASSES": len(BODIES),
    "SENT": records.FATES.index("sent"),
    "QUEUE_FULL": records.FATES.index("queue full"),
    "EXPIRED": records.FATES.index("expired"),
    "GONE": records.FATES.index("gone"),
    "RECEIVED": records.OUTCOMES.index("R"),
    "LOST_NOISE": records.OUTCOMES.index("N"),
    "LOST_COLLISION": records.OUTCOMES.index("C"),
    "LOST_BUSY": records.OUTCOMES.index("B"),
    "LOST_TRANSMITTING": records.OUTCOMES.index("T"),
    "LOST_WEAK": records.OUTCOMES.index("U"),
    "LOS": records.LINKS.index("LOS"),
    "NLOSV": records.LINKS.index("NLOSv"),
    "NLOSB": records.LINKS.index("NLOSb"),
}
PROGRAM: Final = """
#include "records.h"
#include <stddef.h>
#include <stdio.h>
#define KIND(element) _Generic((element), char: 'S', float: 'f', double: 'f', int8_t: 'i', \\
    int16_t: 'i', int32_t: 'i', int64_t: 'i', default: 'u')
#define MEMBER(type, name, element) printf("%s.%s %zu %zu %zu %c\\n", #type, #name, \\
    offsetof(type, name), sizeof(((type *)0)->name), sizeof(((type *)0)->element), \\
    KIND(((type *)0)->element))
int main(void) {
"""


def members(dtype: np.dtype) -> dict[str, np.dtype]:
    """The types of the members by name."""
    return {name: dtype[name] for name in dtype.names or ()}


def element(name: str, dtype: np.dtype) -> str:
    """A C expression for one number, or letter, of a member."""
    return f"{name}[0]" if dtype.shape or dtype.base.kind == "S" else name


def program() -> str:
    """A C program that tells what the compiler makes of the header: a word, then numbers."""
    lines = [f'printf("{name} %zu\\n", sizeof({name}));' for name in STRUCTS]
    lines += [
        f"MEMBER({struct}, {name}, {element(name, kind)});"
        for struct, dtype in STRUCTS.items()
        for name, kind in members(dtype).items()
    ]
    lines += [f'printf("{name} %lld\\n", (long long)({name}));' for name in NUMBERS]
    return f"{PROGRAM}{chr(10).join(lines)}\nreturn 0;\n}}\n"


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """What the program says, by the word in front."""
    folder: Path = tmp_path_factory.mktemp("records")
    (folder / "records.h").write_text(records_header())
    (folder / "layout.c").write_text(program())
    compiler = [sys.executable, "-m", "ziglang", "cc", "-std=c11", "-Wall", "-Wextra", "-Werror"]
    command = [*compiler, str(folder / "layout.c"), "-o", str(folder / "layout")]
    subprocess.run(command, check=True, env=zig_environment())
    answer = subprocess.run([folder / "layout"], check=True, capture_output=True, text=True)
    words = [line.split() for line in answer.stdout.splitlines()]
    return {word: numbers for word, *numbers in words}


def test_every_record_is_there() -> None:
    declared = {id(value) for value in vars(records).values() if isinstance(value, np.dtype)}
    assert declared - {id(records.APM_CELL)} == {id(dtype) for dtype in STRUCTS.values()}
    assert all(value == getattr(records, name) for name, value in (CONSTANTS | KINDS).items())


@pytest.mark.parametrize("name", STRUCTS)
def test_c_and_numpy_lay_out_a_record_alike(told: dict[str, list[str]], name: str) -> None:
    dtype = STRUCTS[name]
    assert told[name] == [str(dtype.itemsize)]
    assert dtype.fields is not None
    for member, kind in members(dtype).items():
        one = 1 if kind.base.kind == "S" else kind.base.itemsize
        expected = [dtype.fields[member][1], kind.itemsize, one, kind.base.kind]
        assert told[f"{name}.{member}"] == list(map(str, expected)), member


def test_c_and_python_number_alike(told: dict[str, list[str]]) -> None:
    assert {name: told[name] for name in NUMBERS} == {k: [str(n)] for k, n in NUMBERS.items()}
    assert len(records.FATES) + len(records.OUTCOMES) + len(records.LINKS) == 4 + 6 + 3
