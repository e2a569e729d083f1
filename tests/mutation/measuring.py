"""Makes the database of which test reaches which line, group of tests by group."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Final

from tests.mutation.reach_plugin import CONTEXT, TABLE
from tests.mutation.trial import environment

GROUPS: Final[Mapping[str, tuple[str, ...]]] = {
    "orchestrator": ("tests/orchestrator", "--ignore=tests/orchestrator/page"),
    "adapters": ("tests/adapters",),
    "units": (
        "tests/fmus/channel/stand_ins",
        "tests/fmus/facilities",
        "tests/fmus/lidar/gpu",
        "tests/fmus/messages",
        "tests/fmus/native",
        "tests/fmus/physics",
        "tests/fmus/relay",
    ),
    "pages": ("tests/orchestrator/page",),
    "driving": ("tests/fmus/driving", "tests/studies/training/test_collector.py"),
    "c": (
        "tests/fmus/channel",
        "tests/fmus/lidar",
        "tests/fmus/perception",
        "--ignore=tests/fmus/channel/stand_ins",
        "--ignore=tests/fmus/lidar/gpu",
    ),
}
"""What pytest runs: the folders of tests that can reach an area."""

_SETTINGS: Final = """\
[run]
core = ctrace
parallel = true
context = ${{{context}-}}
data_file = {folder}/coverage/data
patch = _exit
include =
{included}
disable_warnings = no-data-collected, module-not-imported, already-imported, module-not-measured
"""
_PACKAGES: Final = ("orchestrator", "adapters", "fmus", "studies")


def measure(tree: Path, folder: Path) -> None:
    """Run the tests of all groups that are new or have changed; of the others what is there stays.

    Slow tests are left out: they would take hours under measurement.

    Args:
        tree: the copy of the source tree.
        folder: for the database, `reach.sqlite`, the table of tests, `tests.jsonl`, and the digests
            of their files, `measured.json`.
    """
    (folder / "coverage").mkdir(parents=True, exist_ok=True)
    settings = folder / "coveragerc"
    included = "\n".join(f"    {tree / package}/*" for package in _PACKAGES)
    settings.write_text(_SETTINGS.format(context=CONTEXT, folder=folder, included=included))
    known = folder / "measured.json"
    measured: dict[str, str] = json.loads(known.read_text()) if known.exists() else {}
    for name, words in GROUPS.items():
        files = changed(tree, words, measured)
        if not files:
            continue
        sys.stdout.write(f"{name}: which lines do the tests of {len(files)} files reach?\n")
        sys.stdout.flush()
        _forget(folder / "tests.jsonl", files)
        _run(tree, folder, settings, tuple(files))
        _combine(folder)
        measured |= files
        known.write_text(json.dumps(measured))


def changed(tree: Path, words: Sequence[str], measured: Mapping[str, str]) -> dict[str, str]:
    """Test files of a group that are not as they were measured, with their digests.

    Args:
        tree: where they are.
        words: folders and files, and with `--ignore=` in front what is left out.
        measured: digests, by file.
    """
    ignored = tuple(word.partition("=")[2] for word in words if word.startswith("--ignore="))
    paths = [tree / word for word in words if not word.startswith("--")]
    found = {
        file.relative_to(tree).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for path in paths
        for file in sorted(path.rglob("test_*.py") if path.is_dir() else [path])
    }
    return {
        file: digest
        for file, digest in found.items()
        if measured.get(file) != digest and not file.startswith(ignored or ("//",))
    }


def _forget(table: Path, files: Collection[str]) -> None:
    """Remove what the table says of tests of these files."""
    if table.exists():
        lines = table.read_text("utf-8").splitlines(keepends=True)
        kept = [x for x in lines if json.loads(x)["test"].partition("::")[0] not in files]
        table.write_text("".join(kept), "utf-8")


def _run(tree: Path, folder: Path, settings: Path, words: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow"]
    measured = {
        "COVERAGE_PROCESS_START": str(settings),
        TABLE: str(folder / "tests.jsonl"),
        CONTEXT: "",
    }
    with (folder / "measured.txt").open("ab") as said:
        subprocess.run(
            [*command, "-p", "tests.mutation.reach_plugin", *words],
            cwd=tree,
            env={**environment(tree), **measured},
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            check=False,  # tests that fail reach nothing that a break can be judged by
        )


def _combine(folder: Path) -> None:
    """Add what the processes have written to the database."""
    if files := sorted(map(str, (folder / "coverage").iterdir())):
        command = [sys.executable, "-m", "coverage", "combine", "-q", "--append"]
        database = f"--data-file={folder / 'reach.sqlite'}"
        plain = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE_")}
        subprocess.run([*command, database, *files], check=True, env=plain)
