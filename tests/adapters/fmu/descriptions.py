"""FMUs with something else in modelDescription.xml."""

import zipfile
from pathlib import Path


def changed(path: Path, folder: Path, *changes: tuple[bytes, bytes]) -> Path:
    """The FMU at `path`, in `folder`, with each first text replaced by the second."""
    found = folder / path.name
    with zipfile.ZipFile(path) as before, zipfile.ZipFile(found, "w") as after:
        for name in before.namelist():
            data = before.read(name)
            for old, new in changes if name == "modelDescription.xml" else ():
                assert old in data
                data = data.replace(old, new)
            after.writestr(name, data)
    return found
