"""What grows in the second half of a run is told; what takes what it took is not."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from tests.reliability.processes import Usage, family, usage
from tests.reliability.soak import (
    GROWTH_MB,
    SLOWER,
    SOAKS,
    Sample,
    complaints,
    confirmed,
    reached,
)

STOP: Final = 100.0
LINUX: Final = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells")


def run(**course: Callable[[float], float]) -> list[Sample]:
    """A run that was looked at a hundred times; what it took, as functions of the time."""
    usual: dict[str, Callable[[float], float]] = {
        "memory": lambda t: 100e6 + 1e6 * (t % 7),
        "files": lambda t: 20 + (t % 10 == 0),
        "processor": lambda t: t,
    }
    found = usual | course
    return [
        Sample(
            time=t,
            usage=Usage(
                memory=int(found["memory"](t)),
                files=int(found["files"](t)),
                processor=found["processor"](t),
            ),
        )
        for t in map(float, range(100))
    ]


def test_a_run_that_takes_what_it_took_has_no_complaint() -> None:
    assert complaints(run(), STOP) == []


def test_its_beginning_and_its_end_do_not_count() -> None:
    loading = run(memory=lambda t: 900e6 if t < 9 or t > 98 else 100e6)
    assert complaints(loading, STOP) == []


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_memory_may_grow_by_so_much(share: float) -> None:
    grown = run(memory=lambda t: 100e6 + share * GROWTH_MB * 1e6 * (t >= 60))
    expected = [f"{share * GROWTH_MB:.0f} MB more in the second half"] if share > 1 else []
    assert complaints(grown, STOP) == expected


def test_a_file_that_is_left_open_is_told() -> None:
    leaking = run(files=lambda t: 20 + t // 20)
    assert complaints(leaking, STOP) == ["1 open files more in the second half"]


@pytest.mark.parametrize("times", [0.9 * SLOWER, 1.2 * SLOWER])
def test_steps_may_take_so_many_times_as_long(times: float) -> None:
    slowing = run(processor=lambda t: t if t < 50 else 50 + times * (t - 50))
    expected = [f"a step takes {times:.1f} times as long in the second half"]
    assert complaints(slowing, STOP) == (expected if times > SLOWER else [])


def test_a_run_that_nobody_looked_at_is_no_success() -> None:
    assert complaints([], STOP) == ["it was looked at 0 and 0 times only"]


def test_what_is_there_again_counts_and_what_is_not_does_not() -> None:
    leak, open_files = "26 MB more in the second half", "2 open files more in the second half"
    both = [leak, open_files]
    assert confirmed(both, lambda: ["31 MB more in the second half"]) == [leak]
    assert confirmed(both, lambda: ["1 open files more in the second half", leak]) == both
    assert confirmed(both, lambda: ["a step takes 1.6 times as long in the second half"]) == []


def test_where_there_is_nothing_to_confirm_nobody_runs_again() -> None:
    def never() -> list[str]:
        raise AssertionError

    assert confirmed([], never) == []


@LINUX
def test_children_count_with_their_parent(tmp_path: Path) -> None:
    code = (
        "import subprocess, sys\n"
        f"file = open({str(tmp_path / 'file')!r}, 'w')\n"
        "block = b'x' * 30_000_000\n"
        "print('ready', flush=True)\n"
        "sys.stdin.read()"
    )
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {code!r}])"
    with subprocess.Popen(
        [sys.executable, "-c", parent], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        (_, child) = family(process.pid)
        together, alone = usage(process.pid), usage(child)
        assert alone.files == 4
        assert together.files > alone.files
        assert together.memory > alone.memory > 30e6
        assert together.processor >= alone.processor > 0
        process.communicate()
    assert usage(process.pid) == Usage(memory=0, files=0, processor=0.0)


@LINUX
def test_children_of_any_thread_count() -> None:
    started, ended = threading.Event(), threading.Event()
    children: list[int] = []

    def start() -> None:
        with subprocess.Popen(["sleep", "60"]) as child:
            children.append(child.pid)
            started.set()
            ended.wait()
            child.kill()

    thread = threading.Thread(target=start)
    thread.start()
    try:
        assert started.wait(30)
        assert children[0] in family(os.getpid())
    finally:
        ended.set()
        thread.join()


def test_of_an_experiment_the_runs_count_that_are_done(tmp_path: Path) -> None:
    (experiment,) = (s for s in SOAKS[:3] if s.is_experiment)
    assert reached(experiment, tmp_path) is None
    (tmp_path / "runs.jsonl").write_text('{"seed": 1}\n{"seed": 2}\n{"se')
    assert reached(experiment, tmp_path) == 2
