"""Files that are there as a whole or not at all, and replace nothing unasked."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from orchestrator.disk import naming
from orchestrator.errors import CosimError


class ExportError(CosimError):
    """A run cannot be exported so. Exit code 2."""


def refuse_existing(path: Path, *, force: bool) -> None:
    """See that nothing is in the way of an output.

    Args:
        path: of a file or a folder.
        force: whether what is there may be replaced.

    Raises:
        ExportError: something is there; a folder without contents is nothing.
    """
    if force or not path.exists():
        return
    if path.is_dir() and not any(path.iterdir()):
        return
    raise ExportError(f"`{path}` exists already; --force replaces it, --out PATH writes elsewhere")


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A draft beside `path`, a file or a folder, that takes its place if all goes well.

    Whatever is raised within the block leaves `path` as it was, and no draft behind. If `path` is
    a folder already, the files of the draft are put into it.
    """
    draft = path.with_name(f"{path.name}.draft")
    with naming(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove(draft)
    try:
        with naming(draft):
            yield draft
            if draft.is_dir() and path.is_dir():
                for file in sorted(draft.iterdir()):
                    file.replace(path / file.name)
            else:
                draft.replace(path)
    finally:
        _remove(draft)


def _remove(draft: Path) -> None:
    if draft.is_dir():
        shutil.rmtree(draft)
    else:
        draft.unlink(missing_ok=True)
