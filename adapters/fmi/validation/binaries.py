"""Whether binaries are made for the platforms whose folders they lie in."""

import re
import zipfile
from collections.abc import Iterator
from typing import Final

from adapters.fmi.binary import HEAD, Binary, identify, needed

_FMI2: Final = {
    "linux64": ("x86_64-linux", "aarch64-linux"),
    "linux32": ("x86-linux",),
    "win64": ("x86_64-windows",),
    "win32": ("x86-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
}
_FMI3: Final = re.compile(r"(x86|x86_64|aarch64)-(linux|windows|darwin)")


def made_for(archive: zipfile.ZipFile, name: str) -> Binary | None:
    """What the library `name` is made for; `None` if it is no shared library."""
    with archive.open(name) as library:
        return identify(library.read(HEAD))


def shown(binary: Binary | None) -> str:
    """What a library is, as text."""
    return "no shared library" if binary is None else str(binary)


def misplaced(archive: zipfile.ZipFile, identifier: str, version: int) -> Iterator[tuple[str, str]]:
    """Binaries that cannot be loaded on the platform of their folder: name in the archive, and why.

    Folders that the standard does not name are anybody's.
    """
    for name in archive.namelist():
        found = re.fullmatch(rf"binaries/([^/]+)/{re.escape(identifier)}\.(so|dll|dylib)", name)
        if found is None:
            continue
        folder = found[1]
        own = (folder,) if _FMI3.fullmatch(folder) else ()
        platforms = _FMI2.get(folder, ()) if version == 2 else own
        binary = made_for(archive, name)
        if platforms and not (binary and any(map(binary.runs_on, platforms))):
            wanted = " or ".join(str(needed(platform)) for platform in platforms)
            yield name, f"is {shown(binary)}, in a folder for {wanted}"
