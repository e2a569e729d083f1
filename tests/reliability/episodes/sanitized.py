"""Compiles a unit and the player of episodes into one program under sanitizers."""

import functools
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fmus.native.targets import zig_environment
from fmus.native.unit import SHELL, fmi_headers, load_unit

_HERE: Final = Path(__file__).parent
_WARNINGS: Final = ("-std=c11", "-O1", "-g", "-fno-omit-frame-pointer", "-ffp-contract=off")
_UNDEFINED: Final = ("-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all")
_ADDRESS: Final = "-fsanitize=address"
_ZIG: Final = ("-mcpu=baseline", *_UNDEFINED)
_COMPILERS: Final = ("gcc", "clang")

LARGEST_BLOCK_MB: Final = 64
"""Memory that is asked for in one piece; more is refused, as if it were short [MB]."""

MEMORY_MB: Final = 2000
"""Memory that all instances of an episode may have, sanitizers included [MB]."""

_PROGRAM: Final = "int main(int count, char **words) { (void)words; return count - 1; }\n"


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler that has sanitizers.

    Attributes:
        command: its start.
        flags: those that switch the sanitizers on.
        lacks: what it cannot look for; empty if nothing.
    """

    command: tuple[str, ...]
    flags: tuple[str, ...]
    lacks: str = ""


@functools.cache
def compiler() -> Compiler:
    """One that finds wrong addresses and undefined behaviour; Zig's, which finds the latter only.

    ASan comes with the C compilers of the system, its run-time library included, not with Zig.
    """
    for name in _COMPILERS:
        flags = (f"{_ADDRESS},{_UNDEFINED[0].partition('=')[2]}", _UNDEFINED[1])
        if shutil.which(name) is not None and _makes_programs(name, flags):
            return Compiler((name,), flags)
    lacks = "wrong addresses (ASan): no gcc or clang here has it"
    return Compiler((sys.executable, "-m", "ziglang", "cc"), _ZIG, lacks)


def _makes_programs(name: str, flags: Sequence[str]) -> bool:
    command = [name, *flags, "-x", "c", "-", "-o", os.devnull]
    done = subprocess.run(command, input=_PROGRAM.encode(), capture_output=True, check=False)
    return done.returncode == 0


def build_player(unit_name: str, folder: Path) -> Path:
    """The program that plays episodes of a unit, in `folder`, which exists."""
    unit, chosen = load_unit(unit_name), compiler()
    unit.write_generated(folder)
    sources = [*unit.sources(), folder / "variables.c", _HERE / "player.c"]
    return _compiled(chosen, sources, [folder, SHELL, unit.folder], folder / unit_name)


def build_alone(source: Path, include: Sequence[Path], folder: Path) -> Path:
    """A program of one C file, in `folder`, which exists."""
    return _compiled(compiler(), [source], include, folder / source.stem)


def _compiled(
    chosen: Compiler, sources: Sequence[Path], include: Sequence[Path], program: Path
) -> Path:
    folders = [word for each in include for word in ("-I", str(each))]
    command = [*chosen.command, *_WARNINGS, *chosen.flags, *folders]
    command += ["-isystem", str(fmi_headers()), *map(str, sources)]
    subprocess.run(
        [*command, "-o", str(program), "-lm", "-lpthread"], check=True, env=zig_environment()
    )
    return program


def environment() -> Mapping[str, str]:
    """The environment in which findings end the program, and large blocks are refused."""
    address = {
        "allocator_may_return_null": 1,
        "max_allocation_size_mb": LARGEST_BLOCK_MB,
        "hard_rss_limit_mb": MEMORY_MB,
        "detect_leaks": 0,  # the player counts after each episode
        "quarantine_size_mb": 16,
        "abort_on_error": 0,
        "exitcode": 66,
    }
    options = ":".join(f"{name}={value}" for name, value in address.items())
    return {**os.environ, "ASAN_OPTIONS": options, "UBSAN_OPTIONS": "print_stacktrace=1"}
