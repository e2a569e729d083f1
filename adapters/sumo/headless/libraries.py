"""Stand-in libraries for those that SUMO is linked with for its window, and does not call without.

The wheels `libsumo` and `eclipse-sumo` are linked with X11, OpenGL and libatomic, which no wheel
brings along: a system has them, says the policy of manylinux (PEP 600). A minimal one, as
containers are, has not, and who is not root cannot install them. So a library of the same name
(its `DT_SONAME`) is compiled of `absent.c` during installation, whose functions end the process,
should they be called. The dynamic linker takes what is loaded by a name for what is needed by it.
Where the system has a library it is used.
"""

import ctypes
import functools
import os
import platform
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from adapters.sumo.errors import SumoError

LIBRARIES: Final[Mapping[str, str]] = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXrender.so.1": "libxrender1",
    "libGL.so.1": "libgl1",
    "libatomic.so.1": "libatomic1",
}
"""Whose names are needed, and the Debian packages that have them."""

_PATH: Final = "LD_LIBRARY_PATH"


def import_libsumo() -> Any:
    """The package `libsumo`, with stand-ins where they are needed.

    Raises:
        SumoError: a library is missing, and so is its stand-in.
    """
    stood_in = stand_in()
    try:
        import libsumo  # noqa: PLC0415 - heavy
    except ImportError as error:
        names = [name for name in missing() if name not in stood_in]
        if not names:
            raise
        packages = " ".join(LIBRARIES[name] for name in names)
        raise SumoError(
            f"libsumo cannot be loaded: {', '.join(names)} are not installed, nor what stands in "
            f"for them; on Debian and Ubuntu `apt-get install {packages}` does so, or reinstall "
            "nlosim"
        ) from error
    return libsumo


@functools.cache  # once a stand-in is loaded it is found
def missing() -> tuple[str, ...]:
    """Which of the libraries this system has not; none but on Linux."""
    return tuple(name for name in LIBRARIES if sys.platform == "linux" and not _is_there(name))


def stand_in() -> tuple[str, ...]:
    """Load a stand-in, in this process, for each library that is missing.

    Returns:
        Their names; those are not among them whose stand-ins are not there either.
    """
    return tuple(name for name in missing() if _is_there(str(_folder() / name)))


def with_stand_ins(environment: Mapping[str, str]) -> dict[str, str]:
    """An environment for a program of SUMO: with the stand-ins, if any library is missing.

    Args:
        environment: that the program would have. What it says of libraries goes before.
    """
    if not missing():
        return dict(environment)
    folders = [*filter(None, [environment.get(_PATH)]), str(_folder())]
    return {**environment, _PATH: os.pathsep.join(folders)}


def _is_there(name: str) -> bool:
    """Whether the dynamic linker loads a library, which stays loaded."""
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _folder() -> Path:
    """Where the stand-ins for this machine are."""
    return Path(__file__).parent / f"{platform.machine()}-linux"
