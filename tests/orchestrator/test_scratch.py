"""Temporary folders of processes that are gone are removed, and no others."""

import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.scratch import discard, scratch, sweep, temporary_folder
from tests.reliability.small_runs import written

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="files that are open are locked")

OTHER = """
import os, sys, tempfile
tempfile.tempdir = sys.argv[1]
from orchestrator.scratch import temporary_folder
print(temporary_folder("other"), flush=True)
sys.stdin.read()
os._exit(9)
"""


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def other(temporary: Path) -> tuple["subprocess.Popen[str]", Path]:
    """Another process that has a folder, until its input ends; it removes nothing."""
    process = subprocess.Popen(
        [sys.executable, "-c", OTHER, str(temporary)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_a_process_has_one_folder_and_none_when_it_needs_none(temporary: Path) -> None:
    first, second = temporary_folder("first"), temporary_folder("second")
    (first / "file").write_text("x")
    assert first.parent == second.parent
    assert first.parent.parent == temporary
    assert first.name.startswith("first-")
    discard(first)
    assert second.is_dir()
    discard(second)
    assert list(temporary.iterdir()) == []
    with scratch("third") as third:
        assert third.is_dir()
    assert list(temporary.iterdir()) == []


def test_what_a_killed_process_left_is_removed_by_the_next_that_needs_a_folder(
    temporary: Path,
) -> None:
    """A process that lives keeps its folder, whoever sweeps."""
    process, theirs = other(temporary)
    (theirs / "deep").mkdir()
    (theirs / "deep" / "file").write_text("x")
    sweep()
    assert (theirs / "deep" / "file").is_file()
    process.communicate()
    assert (process.returncode, theirs.is_dir()) == (9, True)
    with scratch("mine") as mine:
        assert not theirs.parent.exists()
        found = {path.name for path in temporary.iterdir()}
        assert found == {mine.parent.name, f"{mine.parent.name}.lock"}
    assert list(temporary.iterdir()) == []


def test_other_files_and_links_are_left_alone(temporary: Path) -> None:
    """A lock without a folder goes; what a link of such a name leads to stays."""
    kept = temporary / "kept"
    kept.mkdir()
    (kept / "file").write_text("x")
    (temporary / "nlosim-0").symlink_to(kept)
    (temporary / "nlosim-0.lock").write_text("")
    (temporary / "nlosim-1").mkdir()
    (temporary / "nlosim-2.lock").write_text("")
    (temporary / "nlosim-3.lock").symlink_to(kept / "file")
    sweep()
    assert (kept / "file").is_file()
    left = {path.name for path in temporary.iterdir()}
    assert left == {"kept", "nlosim-0", "nlosim-1", "nlosim-3.lock"}


def test_threads_may_come_and_go_at_the_same_time(temporary: Path) -> None:
    errors: list[BaseException] = []

    def come_and_go() -> None:
        try:
            for _ in range(100):
                with scratch("mine") as folder:
                    (folder / "file").write_text("x")
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=come_and_go) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert list(temporary.iterdir()) == []


def test_the_garbage_collector_may_discard_a_folder_while_another_is_made(
    temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An FMU that nobody closed discards its own when it is collected, wherever that happens."""
    first = temporary_folder("first")
    make = tempfile.mkdtemp

    def collecting(**options: Any) -> str:
        discard(first)
        return str(make(**options))

    monkeypatch.setattr(tempfile, "mkdtemp", collecting)
    found: list[Path] = []
    maker = threading.Thread(target=lambda: found.append(temporary_folder("second")), daemon=True)
    maker.start()
    maker.join(timeout=20)
    assert [folder.is_dir() for folder in found] == [True]  # else it waits for itself
    assert not first.exists()
    assert found[0].parent == first.parent
    discard(found[0])
    assert list(temporary.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process cannot be copied")
def test_a_copy_of_the_process_has_a_folder_of_its_own(temporary: Path) -> None:
    with scratch("mine") as mine:
        copy = os.fork()
        if copy == 0:
            theirs = temporary_folder("theirs")
            sweep()
            os._exit(0 if theirs.parent != mine.parent and mine.is_dir() else 1)
        _, status = os.waitpid(copy, 0)
        assert status == 0
        sweep()
        assert mine.is_dir()
        assert {path.name for path in temporary.glob("nlosim-*")} == {
            mine.parent.name,
            f"{mine.parent.name}.lock",
        }
    assert list(temporary.iterdir()) == []


def test_a_run_removes_what_killed_processes_left_even_if_it_needs_no_folder(
    temporary: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = temporary / "nlosim-0123abcd"
    (left / "host-1").mkdir(parents=True)
    left.with_suffix(".lock").touch()
    folder = written(tmp_path_factory.mktemp("run"))
    monkeypatch.chdir(folder)
    assert main(["run", "case.yaml", "--set", "time.stop=0.1 s", "--quiet", "--no-figure"]) == 0
    assert list(temporary.iterdir()) == []
