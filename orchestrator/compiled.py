"""The compiled part of the core: one library, made with the FMUs during installation."""

import ctypes
import functools
import platform
from pathlib import Path
from typing import Final

SUFFIXES: Final = {"Linux": ".so", "Darwin": ".dylib", "Windows": ".dll"}
"""How the names of shared libraries end, by operating system."""


def library_path() -> Path:
    """Where the library for this machine is, if it was built."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    system = platform.system()
    name = f"engine-{machine}-{system.lower()}{SUFFIXES.get(system, '.so')}"
    return Path(__file__).parent / "plan" / name


@functools.cache
def library() -> ctypes.CDLL | None:
    """The library; `None` if there is none: Python does the work then."""
    path = library_path()
    return ctypes.CDLL(str(path)) if path.is_file() else None
