"""A copy of the source tree, in which breaks are made."""

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Final

from tests.mutation.mutant import Mutant

BUILT: Final = ("fmus/*/*.fmu", "orchestrator/plan/engine-*")
"""Files that git ignores and the program needs."""

_TIMES: Final = count(int(time.time()))
"""Times of files [s], each another one, in later campaigns, too: Python tells a source from its
compiled form by it."""


def copied(root: Path, tree: Path) -> None:
    """Make `tree` a copy of the sources at `root`; what is the same already stays as it is.

    Args:
        root: of a git work tree; it is only read.
        tree: where the copy is; files that are there no more in `root` are removed.
    """
    wanted = set(_sources(root))
    for name in wanted:
        target = tree / name
        if not target.is_file() or target.read_bytes() != (root / name).read_bytes():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / name, target)
            shutil.copymode(root / name, target)
    known = tree / ".copied"
    before = known.read_text().splitlines() if known.exists() else []
    for name in set(before) - wanted:
        (tree / name).unlink(missing_ok=True)
    known.write_text("\n".join(sorted(wanted)))


@contextmanager
def broken(tree: Path, mutant: Mutant) -> Iterator[None]:
    """Within the block, the copy has this break.

    Raises:
        StaleMutantError: the file has changed.
    """
    path = tree / mutant.file
    source = path.read_bytes()
    path.write_bytes(mutant.applied(source.decode()).encode())
    _stamp(path)
    try:
        yield
    finally:
        path.write_bytes(source)
        _stamp(path)


def _stamp(path: Path) -> None:
    moment = next(_TIMES)
    os.utime(path, (moment, moment))


def _sources(root: Path) -> Iterator[str]:
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, capture_output=True, check=True).stdout.decode()
    yield from (name for name in listed.split("\0") if name and (root / name).is_file())
    for pattern in BUILT:
        yield from (path.relative_to(root).as_posix() for path in root.glob(pattern))
