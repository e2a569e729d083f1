"""`nlosim experiment`: the same tables however the runs were spread, stopped, or failed."""

import contextlib
import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from orchestrator import registry
from orchestrator.campaign import workers
from orchestrator.campaign.journal import read_lines
from orchestrator.campaign.work import Result, RunKey, Work, perform
from orchestrator.campaign.workers import Workers
from orchestrator.cli import main
from orchestrator.experiment.conduct import _work
from orchestrator.experiment.journal import RUNS as JOURNAL, entries
from orchestrator.experiment.load import load_experiment
from tests.installation import site
from tests.interruptions import InterruptedDestructor, record_ignored
from tests.orchestrator.conftest import SAMPLE_UNITS, TWO_UNITS

parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra `experiment`")
pytest.importorskip("distributed", reason="needs the extra `experiment`")

ROOT = Path(__file__).parents[2]
PACKAGES = Path(__file__).parent / "packages"

SCENARIO = TWO_UNITS.replace("components:", "components:\n  fate: {type: mortal, step: 1 s}")
FILE = """\
schema: 1
scenario: two.yaml
seeds: 3
set: {report: trace}
factors:
  noise:
    noisy: {components.car.parameters.noisy: true}
    exact: {components.car.parameters.noisy: false}
metrics: {distance: distance_m, samples: samples}
"""


class Laboratory:
    """A folder with an experiment, and an environment in which its components are installed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "experiment.yaml"
        self.file.write_text(FILE)
        (folder / "two.yaml").write_text(SCENARIO)
        self.environment = {**os.environ, "PYTHONPATH": f"{_installed(folder)}:{PACKAGES}:{ROOT}"}
        self.environment["TMPDIR"] = str(folder / "tmp")
        (folder / "tmp").mkdir()

    def arguments(self, out: str, *options: str) -> list[str]:
        command = [sys.executable, "-m", "orchestrator", "experiment", str(self.file)]
        return [*command, "--json", "--out", str(self.folder / out), *options]

    def run(self, out: str, *options: str, code: int = 0) -> dict[str, Any]:
        """The JSON object of the command, which leaves nothing in the temporary directory."""
        done = subprocess.run(
            self.arguments(out, *options),
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == code, done.stderr
        assert list((self.folder / "tmp").iterdir()) == []
        content: dict[str, Any] = json.loads(done.stdout)
        return content

    def report(self, out: str, code: int = 0) -> dict[str, Any]:
        """The JSON object of `nlosim report`."""
        command = [sys.executable, "-m", "orchestrator", "report", str(self.folder / out), "--json"]
        done = subprocess.run(
            command, env=self.environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == code, done.stderr
        content: dict[str, Any] = json.loads(done.stdout)
        return content

    def start_and_interrupt(self, out: str, *options: str, after: int = 2) -> tuple[int, str]:
        """Send what Ctrl-C in a terminal sends, to all processes, once there are results."""
        process = subprocess.Popen(
            self.arguments(out, *options),
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        journal = self.folder / out / JOURNAL
        while not (journal.exists() and journal.read_text().count("\n") >= after):
            assert process.poll() is None
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        assert list((self.folder / "tmp").iterdir()) == []
        return process.returncode, errors

    def change(self, old: str, new: str) -> None:
        text = self.file.read_text()
        assert old in text
        self.file.write_text(text.replace(old, new))

    def rows(self, out: str) -> list[dict[str, Any]]:
        """The rows without their wall times."""
        table = parquet.read_table(self.folder / out / "runs.parquet").drop_columns(["wall_s"])
        found: list[dict[str, Any]] = table.to_pylist()
        return found

    def summary(self, out: str) -> bytes:
        return (self.folder / out / "summary.csv").read_bytes()


def _installed(folder: Path) -> Path:
    """A folder that Python takes for one in which the sample units are installed."""
    components = {**SAMPLE_UNITS[registry.COMPONENTS], "mortal": "experiment_units:Mortal"}
    return site(folder, "sample-units", {**SAMPLE_UNITS, registry.COMPONENTS: components})


@pytest.fixture
def laboratory(tmp_path: Path) -> Laboratory:
    return Laboratory(tmp_path)


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
def test_an_interrupted_experiment_goes_on_without_loss(laboratory: Laboratory) -> None:
    laboratory.change("seeds: 3", "seeds: 30")
    laboratory.change("set: {", "set: {time.stop: 20 s, ")
    code, errors = laboratory.start_and_interrupt("out", "--workers", "2")
    assert code == 4
    assert "Traceback" not in errors
    assert f"--out {laboratory.folder / 'out'} --resume" in errors
    before = laboratory.rows("out")
    assert 2 <= len(before) < 60
    journal = laboratory.folder / "out" / JOURNAL
    journal.write_text(journal.read_text() + '{"seed": 30, "combin')  # a sudden end
    assert laboratory.run("out", "--resume")["runs"] == 60
    assert all(row in laboratory.rows("out") for row in before)
    laboratory.run("whole", "--workers", "2")
    assert laboratory.rows("out") == laboratory.rows("whole")
    assert laboratory.summary("out") == laboratory.summary("whole")


def test_damaged_lines_of_a_journal_cost_their_runs_only(
    laboratory: Laboratory, caplog: pytest.LogCaptureFixture
) -> None:
    """A bit, a line without sense, bytes that are no text: each is named, its run made again."""
    whole = laboratory.run("out")
    journal = laboratory.folder / "out" / JOURNAL
    lines = journal.read_bytes().splitlines(keepends=True)
    assert len(lines) == 6
    digit = next(k for k in range(len(lines[1])) if lines[1][k : k + 1] in b"12345678")
    flipped = lines[1][:digit] + b"9" + lines[1][digit + 1 :]
    before = laboratory.rows("out")
    journal.write_bytes(lines[0] + flipped + b"[1]\n" + b"\xff\xfe\n" + b"".join(lines[4:]))
    caplog.clear()
    kept = entries(read_lines(journal))
    assert len(kept) == 3
    for number in (2, 3, 4):
        assert f"`{journal}`, line {number}: damaged, and left out" in caplog.text
    assert laboratory.run("out", "--resume")["runs"] == whole["runs"] == 6
    assert laboratory.rows("out") == before
    ordered = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*ordered[:2], b"x\n", *ordered[2:]]))
    assert len(read_lines(journal, ordered=True)) == 2


def test_runs_are_begun_seed_by_seed_however_long_one_takes(laboratory: Laboratory) -> None:
    """No run waits for a worker that is busy while another one has nothing to do."""
    laboratory.change("seeds: 3", "seeds: 6")
    journal = laboratory.folder / "out" / JOURNAL
    lingers = f"components.fate.parameters: {{lines: 11, log: {journal}}}"
    laboratory.change("set: {", f"set: {{{lingers}, ")
    assert laboratory.run("out", "--workers", "2")["runs"] == 12
    done = [json.loads(line) for line in journal.read_text().splitlines()]
    *others, first = [(row["seed"], row["combination"]) for row in done]
    assert first in [(1, 0), (1, 1)]  # both workers begin at once
    assert others == [run for run in sorted([*others, first]) if run != first]


class CarelessWorkers:
    """Perform runs in this process; an interruption falls into a destructor after the second."""

    @contextlib.contextmanager
    def local(self, count: int | None, scratch: Path) -> Iterator[Workers]:
        yield self

    def results(
        self, work: Iterable[tuple[RunKey, Work]]
    ) -> Generator[tuple[RunKey, Result], None, None]:
        for done, (key, each) in enumerate(work, 1):
            if done == 2:
                InterruptedDestructor()
            yield key, perform(each)


@pytest.mark.parametrize(("before", "after"), [(None, "1"), ("3", "3")])
def test_components_have_no_threads_of_their_own_in_workers(
    before: str | None, after: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NLOSIM_THREADS", before or "")
    if before is None:
        monkeypatch.delenv("NLOSIM_THREADS")
    perform(Work(scenario="nowhere.yaml", overrides=(), keep=None, scratch=None))
    assert os.environ["NLOSIM_THREADS"] == after


@pytest.mark.parametrize(("transport", "said"), [("loopback", "loopback"), (None, "in-process")])
def test_runs_take_the_transport_that_was_asked_for(
    scenario_file: Path, transport: str | None, said: str
) -> None:
    path = scenario_file.with_name("experiment.yaml")
    path.write_text(FILE)
    experiment = load_experiment(path, transport)
    keep = scenario_file.with_name("run")
    (first, *_) = (_work(experiment, key, keep.parent) for key in experiment.runs())
    result = perform(first)
    assert result.error is None
    (manifest,) = (json.loads(each.read_text()) for each in keep.parent.glob("*/manifest.json"))
    assert manifest["transport"] == said
    assert manifest["fingerprint"] == result.fingerprint
    command = experiment.command(experiment.runs()[0])
    assert ("--transport loopback" in command) == (transport is not None)


def test_an_unknown_transport_is_refused_before_any_run(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scenario_file.with_name("experiment.yaml")
    path.write_text(FILE)
    assert main(["experiment", str(path), "--transport", "telepathy"]) == 2
    assert "no transport `telepathy` is installed" in capsys.readouterr().err


def test_an_interruption_that_falls_into_a_destructor_is_not_lost(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As those of Dask's futures, which run after every run."""
    ignored = record_ignored(monkeypatch)
    monkeypatch.setattr(workers, "local_workers", CarelessWorkers().local)
    path = scenario_file.with_name("experiment.yaml")
    path.write_text(FILE)
    out = str(scenario_file.with_name("out"))
    assert main(["experiment", str(path), "--out", out]) == 4
    assert ignored == [KeyboardInterrupt]
    assert f"interrupted after 2 of 6 runs; they are in {out}" in capsys.readouterr().err


def test_a_report_is_made_at_the_end_and_again(laboratory: Laboratory) -> None:
    laboratory.change("metrics:", "report: tally\nmetrics:")
    found = laboratory.run("out", "--workers", "1", "--seeds", "5..6")
    assert found["tables"]["tally"] == [{"seed": 5, "n": 2}, {"seed": 6, "n": 2}]
    out = laboratory.folder / "out"
    written = out / "report" / "tally.txt"
    command = f"nlosim experiment {laboratory.file} --seeds 5..6 --out {out}"
    assert written.read_text() == f"4 of 4 runs, {command}"
    summary = laboratory.summary("out")
    for path in (out / "summary.csv", out / "runs.parquet", written, laboratory.file):
        path.unlink()  # neither tables nor the experiment file are needed
    again = laboratory.report("out")
    assert again["tables"] == found["tables"]
    assert laboratory.summary("out") == summary
    assert (len(laboratory.rows("out")), written.is_file()) == (4, True)
    names = {path.name for path in out.iterdir()}
    assert names == {"experiment.json", "runs.jsonl", "runs.parquet", "summary.csv", "report"}


def test_an_interrupted_experiment_has_a_report(laboratory: Laboratory) -> None:
    laboratory.change("seeds: 3", "seeds: 30")
    laboratory.change("metrics:", "report: {type: tally, parameters: {unit: trials}}\nmetrics:")
    laboratory.change("set: {", "set: {time.stop: 20 s, ")
    code, _ = laboratory.start_and_interrupt("out", "--workers", "2", after=12)
    assert code == 4
    done = len(laboratory.rows("out"))
    text = (laboratory.folder / "out" / "report" / "tally.txt").read_text()
    assert text.startswith(f"{done} of 60 trials")
    counts = [row["n"] for row in laboratory.report("out")["tables"]["tally"]]
    assert sum(counts) == done
    # seed by seed: before the last run that is done, each worker may have one that is not
    order = [(seed, level) for seed in range(1, 31) for level in ("noisy", "exact")]
    rows = laboratory.rows("out")
    places = [order.index((row["seed"], row["noise"])) for row in rows]
    assert max(places) + 1 - len(places) <= 2
    assert counts == [sum(row["seed"] == seed for row in rows) for seed in range(1, 31)]
    laboratory.change("trials", "attempts")  # no reason to run anything again
    assert laboratory.run("out", "--resume")["runs"] == 60
    text = (laboratory.folder / "out" / "report" / "tally.txt").read_text()
    assert text.startswith("60 of 60 attempts")


@pytest.mark.parametrize(
    ("name", "code", "message"),
    [
        ("refusing", 2, "the report cannot be made: too few runs; the results are in"),
        ("faulty", 5, "the report cannot be made: LookupError('no such thing')"),
    ],
)
def test_a_failing_report_keeps_the_results(
    laboratory: Laboratory, name: str, code: int, message: str
) -> None:
    laboratory.change("metrics:", "report: tally\nmetrics:")
    laboratory.run("out", "--workers", "1")
    laboratory.change("report: tally", f"report: {name}")
    log = laboratory.folder / "tmp"
    log.rmdir()
    log.mkdir()
    laboratory.environment["TMPDIR"] = str(laboratory.folder)
    error = laboratory.run("out", "--resume", code=code)["error"]
    assert message in error["message"]
    assert len(laboratory.rows("out")) == 6
    report = laboratory.folder / "out" / "report"
    assert [path.name for path in report.iterdir()] == ["tally.txt"]  # the former one
    assert laboratory.report("out", code=code)["error"]["exit_code"] == code
    assert not list((laboratory.folder / "out").glob("*draft*"))


def test_failed_runs_are_reported_even_if_the_report_fails(laboratory: Laboratory) -> None:
    laboratory.change("metrics:", "report: refusing\nmetrics:")
    laboratory.change("seeds: 3", "seeds: 1")
    fault = "components.base.parameters.fails_at: 0.5"
    laboratory.change("noisy: false", f"noisy: false, {fault}")
    found = laboratory.run("out", "--workers", "1", code=3)
    assert [row["noise"] for row in found["failed"]] == ["exact"]
    assert set(found["tables"]) == {"summary"}


def test_results_of_two_commits_are_remarked_upon(laboratory: Laboratory) -> None:
    laboratory.run("out", "--workers", "1")
    identity = laboratory.folder / "out" / "experiment.json"
    content = json.loads(identity.read_text())
    content["sessions"][0]["commit"] = "0123456789ab"
    identity.write_text(json.dumps(content))
    done = subprocess.run(
        laboratory.arguments("out", "--resume"),
        env=laboratory.environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "holds runs of commit 0123456789ab; going on with" in done.stderr
    first, second = json.loads(identity.read_text())["sessions"]
    assert first["commit"] == "0123456789ab"
    assert second["command"].endswith(f"--out {laboratory.folder / 'out'}")


def test_runs_that_come_out_differently_are_not_gone_on_with(laboratory: Laboratory) -> None:
    """One table holds no runs of two states of code, libraries or files."""
    laboratory.run("out", "--workers", "1")
    journal = laboratory.folder / "out" / JOURNAL
    rows = [json.loads(line) for line in journal.read_text().splitlines()]
    for row in rows:
        del row["crc32"]  # as earlier releases wrote them
    last = next(row for row in reversed(rows) if row["combination"] == 1)
    former, last["fingerprint"] = last["fingerprint"], "f" * 64
    journal.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    laboratory.change("seeds: 3", "seeds: 4")
    message = laboratory.run("out", "--resume", code=2)["error"]["message"]
    assert f"the recording of seed {last['seed']}, noise exact had the fingerprint" in message
    assert f"{'f' * 64}, and is {former} now" in message
    last["fingerprint"] = former
    journal.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    assert laboratory.run("out", "--resume")["runs"] == 8


def test_a_directory_of_another_version_is_refused(laboratory: Laboratory) -> None:
    laboratory.run("out", "--workers", "1")
    identity = laboratory.folder / "out" / "experiment.json"
    content = json.loads(identity.read_text())
    del content["metrics"]
    identity.write_text(json.dumps(content))
    message = laboratory.report("out", code=2)["error"]["message"]
    assert "is not of this version of nlosim: 'metrics' is missing" in message
    identity.write_text("{")
    message = laboratory.report("out", code=2)["error"]["message"]
    assert f"`{identity}` is damaged: Expecting property name" in message


def test_what_may_change_before_going_on(laboratory: Laboratory) -> None:
    laboratory.run("out", "--workers", "1")
    journal = laboratory.folder / "out" / JOURNAL
    before = journal.read_text()
    laboratory.change("seeds: 3", "seeds: 1..4")
    laboratory.change("samples: samples", "count: samples")
    assert laboratory.run("out", "--resume", "--workers", "1")["runs"] == 8
    assert journal.read_text().startswith(before)
    assert {row["count"] for row in laboratory.rows("out")} == {21}
    laboratory.change("seeds: 1..4", "seeds: 2..4")
    error = laboratory.run("out", "--resume", code=2)["error"]["message"]
    assert "seeds that the file does not have any more (1); seeds can only be added" in error
    laboratory.change("seeds: 2..4", "seeds: 4")
    laboratory.change("noisy: false", "noisy: true")
    error = laboratory.run("out", "--resume", code=2)["error"]["message"]
    assert "another experiment: the levels, `set` or the scenario changed since" in error
    error = laboratory.run("tmp", "--resume", code=2)["error"]["message"]
    assert "holds no experiment to resume; leave `--resume` out" in error
    error = laboratory.run("out", code=2)["error"]["message"]
    assert "is not empty; choose another directory" in error


@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        ("components.base.parameters.fails_at: 0.5", "the antenna fell off"),
        ("components.fate.parameters.dies: true", "the worker process died"),
    ],
)
def test_a_failed_run_is_reported_with_the_command_that_repeats_it(
    laboratory: Laboratory, setting: str, reason: str
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
    repeated = subprocess.run(
        [sys.executable, "-m", "orchestrator", *command[1:]],
        cwd=laboratory.folder,
        env=laboratory.environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert repeated.returncode == 3


def test_a_misspelt_metric_ends_it_at_the_first_run(laboratory: Laboratory) -> None:
    laboratory.change("distance_m", "distance_n")
    (problem,) = laboratory.run("out", code=2)["error"]["problems"]
    assert (problem["line"], problem["column"]) == (9, 21)
    expected = "the runs have no metric `distance_n`; did you mean `distance_m`?"
    assert problem["message"] == f"metrics.distance: {expected}"
    laboratory.change("distance_n", "distance_m")
    assert laboratory.run("out", "--resume")["runs"] == 6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--resume"], "--resume needs --out DIR"),
        (["--workers", "0"], "--workers must be at least 1, got 0"),
        (["--workers", "2", "--scheduler", "tcp://x:1"], "leave --workers out"),
        (["--seeds", "9..1"], '--seeds: "9..1" is not a range of 1 to 1000000 seeds'),
        (["--seeds", "few"], "--seeds: expected a number of seeds, a range such as `1..50`"),
    ],
)
def test_options_that_make_no_sense(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["experiment", "absent.yaml", *options]) == 2
    assert message in capsys.readouterr().err


def test_a_missing_package_names_the_extra(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    path = scenario_file.with_name("experiment.yaml")
    path.write_text(FILE)
    out = scenario_file.with_name("out")
    assert main(["experiment", str(path), "--out", str(out)]) == 2
    assert "pip install 'nlosim[experiment]'" in capsys.readouterr().err
    assert not out.exists()


@contextlib.contextmanager
def cluster(laboratory: Laboratory, threads: int) -> Iterator[str]:
    """The address of a scheduler with one worker."""
    serve = (
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        f"    with LocalCluster(n_workers=1, threads_per_worker={threads},\n"
        "                      dashboard_address=None) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True)\n"
        "        input()\n"
    )
    script = laboratory.folder / "serve.py"
    script.write_text(serve)
    with subprocess.Popen(
        [sys.executable, str(script)],
        env={**laboratory.environment, "TMPDIR": "/tmp"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.communicate("\n", timeout=60)


def test_the_runs_go_to_a_scheduler_that_is_running(laboratory: Laboratory) -> None:
    with cluster(laboratory, threads=1) as address:
        found = laboratory.run("out", "--scheduler", address)
    assert found["runs"] == 6
    laboratory.run("local", "--workers", "2")
    assert laboratory.rows("out") == laboratory.rows("local")


def test_workers_with_several_threads_are_refused(laboratory: Laboratory) -> None:
    with cluster(laboratory, threads=2) as address:
        error = laboratory.run("out", "--scheduler", address, code=2)["error"]["message"]
    assert "have 2 threads" in error
    assert "`dask worker --nthreads 1`" in error


def test_the_example_runs_for_a_second(tmp_path: Path) -> None:
    example = ROOT / "studies" / "red_light" / "experiments" / "red_light_methods.yaml"
    content = yaml.safe_load(example.read_text())
    content["scenario"] = str((example.parent / content["scenario"]).resolve())
    content |= {"seeds": 1, "set": {"time.stop": "1 s"}}
    path = tmp_path / "short.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    command = [sys.executable, "-m", "orchestrator", "experiment", str(path), "--json"]
    options = ["--out", str(tmp_path / "out"), "--workers", "2"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["runs"] == 4
    levels = [(row["method"], row["density"]) for row in found["tables"]["summary"]]
    assert levels == [(m, d) for m in ("mohed", "direct") for d in ("30 m", "60 m")]
    assert all(row["collision_rate"] == 0 for row in found["tables"]["summary"])
