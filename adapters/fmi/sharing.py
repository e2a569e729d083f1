"""One library for all instances of an FMU, where that changes nothing but the time they take.

Each instance has a folder of its own, and in it a copy of the library: so FMUs with global
variables cannot disturb each other. Copies lie at the same places of the caches, though, and throw
each other out. A library that provably remembers nothing is therefore no copy but another name of
the same file (a hard link), which the dynamic loader recognises: it has the library in memory once,
counts who uses it, and lets it go with the last one. The folders know nothing of each other.
"""

import contextlib
import hashlib
import os
import threading
from pathlib import Path
from typing import Final

from adapters.fmi.static_storage import remembers_nothing


class Libraries:
    """The files of libraries that remember nothing and are in use in this process."""

    def __init__(self) -> None:
        self._turn = threading.RLock()  # the garbage collector may have one leave in another's turn
        self._digests: dict[str, str] = {}

    def enter(self, library: Path) -> None:
        """Replace the file `library` by another name of an equal one in use, if that is harmless.

        Where the system refuses it, e.g. since the file is gone, the copy stays.
        """
        try:
            content = library.read_bytes()
        except OSError:
            return  # the loader will say why
        if not remembers_nothing(content):
            return
        digest = hashlib.sha256(content).hexdigest()
        with self._turn:
            known = self._digests.copy()  # of which none can leave
            others = [Path(name) for name, each in known.items() if each == digest]
            any(_renamed(other, library) for other in reversed(others))
            self._digests[str(library)] = digest

    def leave(self, library: Path) -> None:
        """Forget the file `library`, which need not have been entered."""
        with self._turn:
            self._digests.pop(str(library), None)


def _renamed(other: Path, library: Path) -> bool:
    """Make `library` another name of the file `other`; whether the system did."""
    link = library.with_name(f"{library.name}.link")
    with contextlib.suppress(OSError):
        os.link(other, link)
        link.replace(library)
        return True
    return False


LIBRARIES: Final = Libraries()
"""Those of this process: the loader has one memory, too."""
