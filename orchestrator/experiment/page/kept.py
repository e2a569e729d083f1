"""Where the directories of runs are, if they were kept, and whether they have pages."""

import os
import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from orchestrator.experiment.page.parts import Part
from orchestrator.experiment.report import Row
from orchestrator.page.document import PAGE

KEPT: Final = "runs"
"""The folder of the run directories, if they are kept."""

_NAME: Final = re.compile(r"([0-9]+)-seed-([0-9]+)(?:-([0-9]+))?")


def name(combination: int, seed: int) -> str:
    """The name of the directory of a run; a number is added to that of a further attempt."""
    return f"{combination + 1}-seed-{seed}"


def folders(
    parts: Sequence[Part], page: Path, rows: Sequence[Row], combinations: Sequence[int]
) -> Mapping[str, Sequence[str | bool]]:
    """Directories of rows by their indices as text: of the last attempt, and whether it has a page.

    Args:
        parts: the experiments of the page.
        page: the folder of the page, to which the directories are relative.
        rows: of runs.
        combinations: of these, among those of all experiments.
    """
    known: dict[str, Sequence[str | bool]] = {}
    starts = [part.first for part in parts]
    last = [_last_attempts(part.directory / KEPT) for part in parts]
    for index, (row, combination) in enumerate(zip(rows, combinations, strict=True)):
        number = bisect_right(starts, combination) - 1
        key = name(combination - starts[number], row["seed"])
        if key in last[number]:
            attempt = last[number][key]
            folder = parts[number].directory / KEPT / (key if attempt == 1 else f"{key}-{attempt}")
            relative = Path(os.path.relpath(folder, page)).as_posix()
            known[str(index)] = [relative, (folder / PAGE).is_file()]
    return known


def _last_attempts(parent: Path) -> Mapping[str, int]:
    """The number of the last attempt of every run that was kept."""
    last: dict[str, int] = {}
    for path in parent.iterdir() if parent.is_dir() else ():
        found = _NAME.fullmatch(path.name)
        if found is not None:
            key = f"{found[1]}-seed-{found[2]}"
            last[key] = max(last.get(key, 0), int(found[3] or 1))
    return last
