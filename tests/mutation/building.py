"""Builds what a C file belongs to, in the copy of the tree."""

import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from tests.mutation.areas import unit_of
from tests.mutation.trial import environment

_ENGINE: Final = (
    "from fmus.native.libraries import build_libraries; "
    "from fmus.native.targets import select_targets; "
    "build_libraries(select_targets(['host']), force=True)"
)


class BuildError(Exception):
    """The compiler refuses the break, or makes the same program of it."""


@contextmanager
def built(tree: Path, work: Path, file: str) -> Iterator[None]:
    """Within the block, the binary is what the C file makes as it stands now.

    Args:
        tree: the copy of the tree, in which `prepared` has built the unbroken binary.
        work: a folder where that is kept meanwhile.
        file: that was changed, from the root.

    Raises:
        BuildError: there is nothing new to run.
    """
    files = _binaries(tree, file)
    former = _code(files[0])
    for each in files:
        shutil.copy2(each, work / each.name)
    try:
        _build(tree, file)
        if _code(files[0]) == former:
            raise BuildError("the same program")
        yield
    finally:
        for each in files:
            shutil.copy2(work / each.name, each)


def prepared(tree: Path, file: str) -> None:
    """Build what the unbroken file belongs to for this host only, to compare with."""
    _build(tree, file)


def _build(tree: Path, file: str) -> None:
    unit = unit_of(file)
    words = ["-c", _ENGINE]
    if unit is not None:
        words = ["-m", "orchestrator", "fmu", "build", unit, "--target", "host", "--force"]
    done = subprocess.run(
        [sys.executable, *words],
        cwd=tree,
        env=environment(tree),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise BuildError((done.stdout + done.stderr)[-2000:])


def _binaries(tree: Path, file: str) -> list[Path]:
    """What is built, first the machine code."""
    unit = unit_of(file)
    if unit is not None:
        return [tree / "fmus" / unit / f"{unit}.fmu"]
    found = (tree / "orchestrator" / "plan").glob("engine-*")
    return sorted(found, key=lambda path: path.suffix == ".digest")


def _code(binary: Path) -> bytes:
    """The machine code: of an FMU what is below `binaries/`."""
    if binary.suffix != ".fmu":
        return binary.read_bytes()
    with zipfile.ZipFile(binary) as archive:
        names = sorted(name for name in archive.namelist() if name.startswith("binaries/"))
        return b"".join(archive.read(name) for name in names if not name.endswith("/"))
