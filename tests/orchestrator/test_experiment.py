"""`nlosim experiment`: tables, reports and journals, whoever performs the runs.

How processes perform them is in `test_experiment_processes`.
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Generator, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from orchestrator.campaign import workers
from orchestrator.campaign.journal import ResumeError, read_lines
from orchestrator.campaign.work import Result, RunKey, Work, perform
from orchestrator.campaign.workers import Workers
from orchestrator.cli import main
from orchestrator.experiment.conduct import _compare, _work
from orchestrator.experiment.journal import entries
from orchestrator.experiment.load import load_experiment
from orchestrator.scenario.installed import scenario_path
from tests.full_disk import DiskFillsUp, files_as_before
from tests.interruptions import InterruptedDestructor, record_ignored
from tests.workers import workers_here

pytest.importorskip("pyarrow.parquet", reason="needs the extra `experiment`")
pytest.importorskip("distributed", reason="needs the extra `experiment`")

from tests.orchestrator.laboratory import FILE, ROOT, Here, Laboratory


@pytest.fixture
def laboratory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Laboratory:
    return Laboratory(tmp_path, Here(tmp_path, monkeypatch, capsys))


def test_damaged_lines_of_a_journal_cost_their_runs_only(
    laboratory: Laboratory, caplog: pytest.LogCaptureFixture
) -> None:
    """A bit, a line without sense, bytes that are no text: each is named, its run made again."""
    whole = laboratory.run("out")
    journal = laboratory.journal("out")
    lines = journal.read_bytes().splitlines(keepends=True)
    assert len(lines) == 6
    digit = next(k for k in range(len(lines[1])) if lines[1][k : k + 1] in b"12345678")
    flipped = lines[1][:digit] + b"9" + lines[1][digit + 1 :]
    before = laboratory.rows("out")
    journal.write_bytes(lines[0] + flipped + b"[1]\n" + b"\xff\xfe\n" + b"".join(lines[4:]))
    caplog.clear()
    kept = entries(read_lines(journal).contents)
    assert len(kept) == 3
    for number in (2, 3, 4):
        what = f"line {number}: damaged, and left out; `--resume` does again what it told of"
        assert f"`{journal}`, {what}" in caplog.messages
    assert laboratory.run("out", "--resume")["runs"] == whole["runs"] == 6
    assert laboratory.rows("out") == before
    ordered = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*ordered[:2], b"x\n", *ordered[2:]]))
    assert len(read_lines(journal, ordered=True).contents) == 2
    assert "line 3: damaged, and left out with all behind it; `--resume` does" in caplog.text


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


COST = """\
import subprocess
import sys
import time

from orchestrator.campaign import work

CHILD = "import time\\nwhile time.process_time() < 0.2: pass"


def run(_work, _scenario):
    time.sleep(0.3)
    subprocess.run([sys.executable, "-S", "-c", CHILD], check=True)
    return work.Result(wall=0.0, fingerprint="0", metrics={}, error=None)


work._run = run
one = work.Work(scenario=sys.argv[1], overrides=(), keep=None, scratch=None)
result = work.perform(one)
assert result.error is None, result.error
print(result.cpu, result.wall)
"""


def test_the_cost_of_a_run_is_its_processor_time_and_that_of_its_children() -> None:
    """Of a run that sleeps for 0.3 s, and starts a process that computes for 0.2 s.

    In a process of its own: threads and children of other tests would count.
    """
    command = [sys.executable, "-c", COST, str(scenario_path("red_light"))]
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": root}
    )
    cpu, wall = map(float, done.stdout.split())
    assert 0.19 <= cpu <= wall - 0.28  # processor time is counted in hundredths


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
    assert capsys.readouterr().err.endswith(
        f"interrupted after 2 of 6 runs; they are in {out}\n"
        f"go on with: nlosim experiment {path} --out {out} --resume\n"
    )


@pytest.mark.skipif(sys.platform != "linux", reason="files of limited size stand for a full disk")
def test_a_full_disk_stops_an_experiment_that_goes_on_when_there_is_room(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of six runs two are noted, and the third was written in part."""
    whole = laboratory.run("whole")
    out = laboratory.folder / "out"
    filled = DiskFillsUp(laboratory.journal("out"), after=3)
    with monkeypatch.context() as context, files_as_before():
        context.setattr(workers, "local_workers", lambda *_: filled.pool())
        stopped = laboratory.execute(laboratory.arguments("out"))
    error = laboratory.read(stopped, code=2)["error"]
    assert (error["message"], error["out"]) == ("File too large", str(out))
    assert stopped.errors == (
        f"error: File too large\nwhat is finished is in {out}; once the cause is mended, "
        f"go on with: nlosim experiment {laboratory.file} --out {out} --resume\n"
    )
    assert len(entries(read_lines(laboratory.journal("out")).contents)) == 2
    assert laboratory.run("out", "--resume") == {
        **whole,
        "out": str(out),
        "page": str(out / "index.html"),
    }
    assert laboratory.rows("out") == laboratory.rows("whole")


def test_a_report_is_made_at_the_end_and_again(laboratory: Laboratory) -> None:
    laboratory.change("metrics:", "report: tally\nmetrics:")
    found = laboratory.run("out", "--seeds", "5..6")
    assert found["tables"]["tally"] == [{"seed": 5, "n": 2}, {"seed": 6, "n": 2}]
    out = laboratory.folder / "out"
    written = out / "report" / "tally.txt"
    command = f"nlosim experiment {laboratory.file} --seeds 5..6 --out {out}"
    assert written.read_text() == f"4 of 4 runs, {command}"
    summary = laboratory.summary("out")
    for path in (out / "summary.csv", out / "runs.parquet", written, laboratory.file):
        path.unlink()  # neither tables nor the experiment file are needed
    written.with_name("of_another_report.txt").touch()
    again = laboratory.report("out")
    assert list(written.parent.iterdir()) == [written]  # whatever was there before
    assert again["tables"] == found["tables"]
    assert laboratory.summary("out") == summary
    assert (len(laboratory.rows("out")), written.is_file()) == (4, True)
    names = {path.name for path in out.iterdir()}
    tables = {"runs.parquet", "summary.csv"}
    assert names == {"experiment.json", "runs.jsonl", *tables, "report", "index.html"}


@pytest.mark.parametrize(
    ("name", "code", "message"),
    [
        ("refusing", 2, "the report cannot be made: too few runs; the results are in"),
        ("faulty", 3, "the report cannot be made: the report `faulty` failed: LookupError"),
    ],
)
def test_a_failing_report_keeps_the_results(
    laboratory: Laboratory, name: str, code: int, message: str
) -> None:
    laboratory.change("metrics:", "report: tally\nmetrics:")
    laboratory.run("out")
    laboratory.change("report: tally", f"report: {name}")
    error = laboratory.run("out", "--resume", code=code)["error"]
    assert message in error["message"]
    assert len(laboratory.rows("out")) == 6
    report = laboratory.folder / "out" / "report"
    assert [path.name for path in report.iterdir()] == ["tally.txt"]  # the former one
    assert laboratory.report("out", code=code)["error"]["exit_code"] == code
    assert not list((laboratory.folder / "out").glob("*draft*"))


def test_a_report_that_cannot_check_its_parameters_is_named(laboratory: Laboratory) -> None:
    laboratory.change("metrics:", "report: careless\nmetrics:")
    error = laboratory.run("out", code=3)["error"]
    assert error["kind"] == "plugin"
    said = "the report `Careless`, asked what is wrong, failed: LookupError: no such column"
    assert error["message"] == said
    assert error["raised_at"].endswith(", in check")
    assert not (laboratory.folder / "out").exists()


def test_failed_runs_are_reported_even_if_the_report_fails(laboratory: Laboratory) -> None:
    laboratory.change("metrics:", "report: refusing\nmetrics:")
    laboratory.change("seeds: 3", "seeds: 1")
    fault = "components.base.parameters.fails_at: 0.5"
    laboratory.change("noisy: false", f"noisy: false, {fault}")
    found = laboratory.run("out", code=3)
    assert [row["noise"] for row in found["failed"]] == ["exact"]
    assert set(found["tables"]) == {"summary"}


def test_results_of_two_commits_are_remarked_upon(
    laboratory: Laboratory, caplog: pytest.LogCaptureFixture
) -> None:
    laboratory.run("out")
    identity = laboratory.folder / "out" / "experiment.json"
    content = json.loads(identity.read_text())
    content["sessions"][0]["commit"] = "0123456789ab"
    identity.write_text(json.dumps(content))
    laboratory.run("out", "--resume")
    assert "holds runs of commit 0123456789ab; going on with" in caplog.text
    first, second = json.loads(identity.read_text())["sessions"]
    assert f"going on with {second['commit'] or 'unknown'}, whose results may differ" in caplog.text
    assert first["commit"] == "0123456789ab"
    assert second["command"].endswith(f"--out {laboratory.folder / 'out'}")


def test_runs_that_come_out_differently_are_not_gone_on_with(laboratory: Laboratory) -> None:
    """One table holds no runs of two states of code, libraries or files."""
    laboratory.run("out")
    journal = laboratory.journal("out")
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


def test_a_failed_run_is_made_again_when_the_experiment_goes_on(laboratory: Laboratory) -> None:
    """It is not done: what failed may have been the disk."""
    laboratory.run("out")
    before, journal = laboratory.rows("out"), laboratory.journal("out")
    rows = [json.loads(line) for line in journal.read_text().splitlines()]
    for row in rows:
        del row["crc32"]
    rows[2] |= {"fingerprint": None, "metrics": {}, "error": "no space left"}
    journal.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    found = laboratory.run("out", "--resume")
    assert (found["runs"], found["failed"]) == (6, [])
    assert laboratory.rows("out") == before


def test_a_run_that_is_made_again_and_fails_now_is_not_gone_on_with(scenario_file: Path) -> None:
    path = scenario_file.with_name("experiment.yaml")
    path.write_text(FILE)
    experiment = load_experiment(path, None)
    key = experiment.runs()[0]
    former = Result(wall=1.0, fingerprint="a" * 64, metrics={}, error=None)
    _compare(experiment, path.parent, key, former, replace(former, wall=2.0))
    now = replace(former, fingerprint=None, error="the antenna fell off")
    with pytest.raises(ResumeError, match=r"a{64}, and fails now: the antenna fell off\. "):
        _compare(experiment, path.parent, key, former, now)


def test_a_directory_of_another_version_is_refused(laboratory: Laboratory) -> None:
    laboratory.run("out")
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
    laboratory.run("out")
    journal = laboratory.journal("out")
    before = journal.read_text()
    laboratory.change("seeds: 3", "seeds: 1..4")
    laboratory.change("samples: samples", "count: samples")
    assert laboratory.run("out", "--resume")["runs"] == 8
    assert journal.read_text().startswith(before)
    assert {row["count"] for row in laboratory.rows("out")} == {21}
    laboratory.change("seeds: 1..4", "seeds: 2..4")
    error = laboratory.run("out", "--resume", code=2)["error"]["message"]
    assert "seeds that the file does not have any more (1); seeds can be added, and" in error
    laboratory.change("seeds: 2..4", "seeds: 4")
    laboratory.change("noisy: false", "noisy: true")
    error = laboratory.run("out", "--resume", code=2)["error"]["message"]
    assert "another experiment: the levels, `set` or the scenario changed since" in error
    error = laboratory.run("tmp", "--resume", code=2)["error"]["message"]
    assert "holds no experiment to resume; leave `--resume` out" in error
    error = laboratory.run("out", code=2)["error"]["message"]
    assert "is not empty; choose another directory" in error


def test_seeds_that_no_run_was_made_with_may_be_left_out(laboratory: Laboratory) -> None:
    laboratory.run("out")
    journal = laboratory.journal("out")
    lines = journal.read_text().splitlines(keepends=True)
    kept = [line for line in lines if json.loads(line)["seed"] < 3]
    assert (len(lines), len(kept)) == (6, 4)
    journal.write_text("".join(kept))
    laboratory.change("seeds: 3", "seeds: 2")
    assert laboratory.run("out", "--resume")["runs"] == 4
    assert journal.read_text() == "".join(kept)
    assert json.loads((laboratory.folder / "out" / "experiment.json").read_text())["seeds"] == [
        1,
        2,
    ]
    laboratory.change("seeds: 2", "seeds: 3..4")
    error = laboratory.run("out", "--resume", code=2)["error"]["message"]
    assert "seeds that the file does not have any more (1, ...); seeds can be added, and" in error


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


@pytest.mark.slow
def test_the_example_runs_for_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(workers, "local_workers", workers_here)
    example = ROOT / "studies" / "red_light" / "experiments" / "red_light_methods.yaml"
    content = yaml.safe_load(example.read_text())
    content["scenario"] = str((example.parent / content["scenario"]).resolve())
    content |= {"seeds": 1, "set": {"time.stop": "1 s"}}
    path = tmp_path / "short.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    assert main(["experiment", str(path), "--json", "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["runs"] == 4
    levels = [(row["method"], row["density"]) for row in found["tables"]["summary"]]
    assert levels == [(m, d) for m in ("mohed", "direct") for d in ("30 m", "60 m")]
    assert all(row["collision_rate"] == 0 for row in found["tables"]["summary"])


@pytest.mark.parametrize(
    ("key", "value"),
    [("sessions", ["x"]), ("seeds", "12"), ("metrics", {"a": 3}), ("combinations", [[]])],
)
def test_an_experiment_whose_description_is_of_another_kind_is_named(
    laboratory: Laboratory, key: str, value: object
) -> None:
    laboratory.run("out")
    path = laboratory.folder / "out" / "experiment.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    error = laboratory.report("out", code=2)["error"]
    assert "experiment.json` is damaged: a value in it is of another kind" in error["message"]
