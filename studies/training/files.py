"""Files that survive a sudden end: a reader finds the old one or the new one, never a part."""

import os
from pathlib import Path


def write(path: Path, content: bytes) -> None:
    """Write a file; when this returns, it is on the disk."""
    path.parent.mkdir(exist_ok=True)
    draft = path.with_name(f"draft-{path.name}")
    draft.write_bytes(content)
    settle(draft, path)


def settle(draft: Path, path: Path) -> None:
    """Give the finished file `draft` its name; when this returns, it is on the disk."""
    with draft.open("rb+") as file:
        os.fsync(file.fileno())
    draft.replace(path)
