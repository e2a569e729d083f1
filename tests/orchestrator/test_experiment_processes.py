"""`nlosim experiment`: the same tables however the runs were spread, stopped, or failed."""

import contextlib
import json
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pyarrow.parquet", reason="needs the extra `experiment`")
pytest.importorskip("distributed", reason="needs the extra `experiment`")

from orchestrator.campaign.workers import DaskWorkers, local_workers
from tests.orchestrator.laboratory import Here, Laboratory, Program

psutil = pytest.importorskip("psutil", reason="comes with it")


@pytest.fixture
def program(tmp_path: Path) -> Program:
    return Program(tmp_path)


@pytest.fixture
def here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Here:
    return Here(tmp_path, monkeypatch, capsys)


@pytest.fixture
def laboratory(tmp_path: Path, program: Program) -> Laboratory:
    return Laboratory(tmp_path, program)


@pytest.mark.slow
def test_the_tables_do_not_depend_on_the_number_of_workers(laboratory: Laboratory) -> None:
    one, two = (laboratory.run(f"out-{n}", "--workers", str(n)) for n in (1, 2))
    assert one["runs"] == two["runs"] == 6
    assert one["tables"] == two["tables"]
    assert laboratory.rows("out-1") == laboratory.rows("out-2")
    assert laboratory.summary("out-1") == laboratory.summary("out-2")
    rows = laboratory.rows("out-1")
    assert [(row["noise"], row["seed"]) for row in rows] == [
        (level, seed) for level in ("noisy", "exact") for seed in (1, 2, 3)
    ]
    assert {row["distance"] for row in rows if row["noise"] == "exact"} == {20.0}
    noisy, exact = one["tables"]["summary"]
    assert exact == {
        "noise": "exact",
        "n": 3,
        "distance": 20,
        "distance_low": 20,
        "distance_high": 20,
        "distance_n": 3,
        "samples": 21,
        "samples_low": 21,
        "samples_high": 21,
        "samples_n": 3,
    }
    assert noisy["distance_low"] < noisy["distance"] < noisy["distance_high"]


@pytest.mark.slow
def test_an_interrupted_experiment_has_a_report_and_goes_on_without_loss(
    laboratory: Laboratory, program: Program, here: Here
) -> None:
    laboratory.change("seeds: 3", "seeds: 20")
    laboratory.change("metrics:", "report: {type: tally, parameters: {unit: trials}}\nmetrics:")
    laboratory.change("set: {", "set: {time.stop: 20 s, ")
    journal = laboratory.journal("out")
    command = laboratory.arguments("out", "--workers", "2")
    interrupted = program.interrupted(
        command, lambda _: journal.exists() and journal.read_text().count("\n") >= 8
    )
    found = laboratory.read(interrupted, code=4)
    assert "Traceback" not in interrupted.errors
    assert f"--out {laboratory.folder / 'out'} --resume" in interrupted.errors
    before = laboratory.rows("out")
    assert 8 <= len(before) < 40
    text = (laboratory.folder / "out" / "report" / "tally.txt").read_text()
    assert text.startswith(f"{len(before)} of 40 trials")
    laboratory.execute = here
    again = laboratory.report("out")["tables"]["tally"]
    assert again == found["error"]["tables"]["tally"]
    # seed by seed: before the last run that is done, each worker may have one that is not
    order = [(seed, level) for seed in range(1, 21) for level in ("noisy", "exact")]
    places = [order.index((row["seed"], row["noise"])) for row in before]
    assert max(places) + 1 - len(places) <= 2
    counts = [sum(row["seed"] == seed for row in before) for seed in range(1, 21)]
    assert [row["n"] for row in again] == counts
    journal.write_text(journal.read_text() + '{"seed": 20, "combin')  # a sudden end
    laboratory.change("trials", "attempts")  # no reason to run anything again
    assert laboratory.run("out", "--resume")["runs"] == 40
    text = (laboratory.folder / "out" / "report" / "tally.txt").read_text()
    assert text.startswith("40 of 40 attempts")
    assert all(row in laboratory.rows("out") for row in before)
    laboratory.run("whole")
    assert laboratory.rows("out") == laboratory.rows("whole")
    assert laboratory.summary("out") == laboratory.summary("whole")


@pytest.mark.slow
@pytest.mark.parametrize("age", [0.3, 1.0])
def test_ctrl_c_while_workers_start_is_heard_by_the_conductor_alone(
    age: float, laboratory: Laboratory, program: Program
) -> None:
    """A worker process is so old [s] when it comes; neither age is enough to ignore it."""

    def is_such_a_worker(process: Any) -> bool:
        with contextlib.suppress(psutil.NoSuchProcess):  # others end as they are looked at
            is_worker = "spawn_main" in " ".join(process.cmdline())
            return is_worker and time.time() - process.create_time() > age
        return False

    def has_begun(process: int) -> bool:
        return any(map(is_such_a_worker, psutil.Process(process).children(recursive=True)))

    interrupted = program.interrupted(laboratory.arguments("out", "--workers", "2"), has_begun)
    found = laboratory.read(interrupted, code=4)
    assert found["error"]["kind"] == "interrupted"
    assert "Traceback" not in interrupted.errors


@pytest.mark.slow
def test_runs_are_begun_seed_by_seed_however_long_one_takes(laboratory: Laboratory) -> None:
    """No run waits for a worker that is busy while another one has nothing to do."""
    laboratory.change("seeds: 3", "seeds: 6")
    journal = laboratory.journal("out")
    lingers = f"components.fate.parameters: {{lines: 11, log: {journal}}}"
    laboratory.change("set: {", f"set: {{{lingers}, ")
    assert laboratory.run("out", "--workers", "2")["runs"] == 12
    done = [json.loads(line) for line in journal.read_text().splitlines()]
    *others, first = [(row["seed"], row["combination"]) for row in done]
    assert first in [(1, 0), (1, 1)]  # both workers begin at once
    assert others == [run for run in sorted([*others, first]) if run != first]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        ("components.base.parameters.fails_at: 0.5", "the antenna fell off"),
        ("components.fate.parameters.dies: true", "the worker process died"),
    ],
)
def test_a_failed_run_is_reported_with_the_command_that_repeats_it(
    laboratory: Laboratory, program: Program, setting: str, reason: str
) -> None:
    laboratory.change("seeds: 3", "seeds: 1")
    laboratory.change("noisy: false", f"noisy: false, {setting}")
    found = laboratory.run("out", "--workers", "1", "--keep-runs", code=3)
    (failed,) = found["failed"]
    assert (failed["seed"], failed["noise"]) == (1, "exact")
    assert reason in failed["message"]
    assert [row["n"] for row in found["tables"]["summary"]] == [1, 0]
    kept = {path.name for path in (laboratory.folder / "out" / "runs").iterdir()}
    # tried twice; the other run is repeated if its result was still with the worker that died
    assert kept - {"1-seed-1-2"} == {"1-seed-1", "2-seed-1", "2-seed-1-2"}
    noisy, exact = laboratory.rows("out")
    assert (noisy["error"], exact["fingerprint"], exact["distance"]) == (None, None, None)
    command = shlex.split(failed["command"])
    assert command[0] == "nlosim"
    assert program([*command[1:], "--out", str(laboratory.folder / "again")]).code == 3


@contextlib.contextmanager
def cluster(program: Program, folder: Path, threads: int) -> Iterator[str]:
    """The address of a scheduler with one worker."""
    serve = (
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        f"    with LocalCluster(n_workers=1, threads_per_worker={threads},\n"
        "                      dashboard_address=None) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True)\n"
        "        input()\n"
    )
    script = folder / "serve.py"
    script.write_text(serve)
    with subprocess.Popen(
        [sys.executable, str(script)],
        env={**program.environment, "TMPDIR": "/tmp"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.communicate("\n", timeout=60)


@pytest.mark.slow
def test_the_runs_go_to_a_scheduler_that_is_running(
    laboratory: Laboratory, program: Program, here: Here
) -> None:
    with cluster(program, laboratory.folder, threads=1) as address:
        found = laboratory.run("out", "--scheduler", address)
    assert found["runs"] == 6
    laboratory.execute = here
    laboratory.run("local")
    assert laboratory.rows("out") == laboratory.rows("local")


@pytest.mark.slow
def test_workers_with_several_threads_are_refused(laboratory: Laboratory, program: Program) -> None:
    with cluster(program, laboratory.folder, threads=2) as address:
        error = laboratory.run("out", "--scheduler", address, code=2)["error"]["message"]
    assert "have 2 threads" in error
    assert "`dask worker --nthreads 1`" in error


@pytest.mark.slow
def test_a_worker_that_dask_gives_up_is_replaced(tmp_path: Path) -> None:
    """As those are whose run ends their process before Dask has noticed that they are there."""
    with local_workers(1, tmp_path) as workers:
        assert isinstance(workers, DaskWorkers)
        client = workers._client
        (given_up,) = client.cluster.workers.values()
        client.cluster.sync(given_up.close)
        assert client.submit(os.getppid, pure=False).result(timeout=60) == os.getpid()
