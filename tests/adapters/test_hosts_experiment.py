"""Experiments whose components are on hosts."""

import contextlib
import json
from collections.abc import Generator, Iterable, Iterator
from pathlib import Path

import pytest

from orchestrator.campaign import workers
from orchestrator.campaign.work import Result, RunKey, Work, perform
from orchestrator.campaign.workers import Workers
from orchestrator.cli import main
from orchestrator.errors import ComponentError, ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.hosts_file import read_hosts
from tests.adapters.hosting import SCENARIO, Site, free_port

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
pytest.importorskip("pyarrow.parquet", reason="needs the extra `experiment`")
pytest.importorskip("distributed", reason="needs the extra `experiment`")

FILE = """\
schema: 1
scenario: ring.yaml
seeds: 2
factors:
  pace:
    slow: {components.here.parameters.rate: 1}
    fast: {components.here.parameters.rate: 9}
metrics:
  last: {signal: here.y, statistic: last}
"""


class Here:
    """Workers that perform runs in this process, one after the other."""

    def __init__(self) -> None:
        self.counts: list[int | None] = []
        self.done: list[Work] = []

    @contextlib.contextmanager
    def local(self, count: int | None, scratch: Path) -> Iterator[Workers]:
        self.counts.append(count)
        yield self

    def results(
        self, work: Iterable[tuple[RunKey, Work]]
    ) -> Generator[tuple[RunKey, Result], None, None]:
        for key, each in work:
            self.done.append(each)
            yield key, perform(each)


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> Here:
    found = Here()
    monkeypatch.setattr(workers, "local_workers", found.local)
    return found


@pytest.fixture
def site(tmp_path: Path) -> Site:
    text = SCENARIO.replace("host: gpu", "host: partner")
    made = Site(tmp_path / "site", text, {"partner": free_port()})
    (made.folder / "experiment.yaml").write_text(FILE)
    return made


def said(
    capsys: pytest.CaptureFixture[str], site: Site, out: str, *words: str | Path
) -> tuple[int, str, str]:
    command = ["experiment", site.folder / "experiment.yaml", "--out", site.folder / out, *words]
    code = main([*map(str, command)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def fingerprints(folder: Path) -> list[str]:
    lines = (folder / "runs.jsonl").read_text().splitlines()
    return [json.loads(line)["fingerprint"] for line in lines]


def test_its_runs_use_the_hosts_one_after_the_other_and_are_the_same_bytes(
    site: Site, here: Here, capsys: pytest.CaptureFixture[str]
) -> None:
    with site.serving("partner", "near", "far", "apart") as lines:
        code, text, _ = said(capsys, site, "away", "--hosts", site.hosts)
    assert code == 0
    assert "(a remark)" not in text
    assert here.counts == [1]
    assert [work.hosts for work in here.done] == [str(site.hosts)] * 4
    assert lines.count("`far`: the run `ring` has ended at t = 0.1 s") == 4
    assert said(capsys, site, "here")[0] == 0
    assert here.counts == [1, None]
    assert fingerprints(site.folder / "away") == fingerprints(site.folder / "here")
    assert len(set(fingerprints(site.folder / "away"))) == 4


def test_without_a_hosts_file_it_says_what_is_here(
    site: Site, here: Here, capsys: pytest.CaptureFixture[str]
) -> None:
    code, text, _ = said(capsys, site, "out")
    remarks = [line for line in text.splitlines() if line.endswith("(a remark)")]
    where = [f"{site.scenario}:{line}:{column}" for line, column in [(6, 45), (7, 44), (8, 46)]]
    assert code == 0
    assert remarks == [
        f"{place}: `{name}` is here: `host: partner` takes effect with `--hosts FILE` (a remark)"
        for place, name in zip(where, ("near", "far", "apart"), strict=True)
    ]


def test_what_is_not_here_takes_a_hosts_file(
    site: Site, here: Here, capsys: pytest.CaptureFixture[str]
) -> None:
    head, far, rest = site.scenario.read_text().partition("  far: ")
    site.scenario.write_text(head + far + rest.replace("parts:", "secret:", 1))
    code, _, text = said(capsys, site, "out")
    assert code == 2
    assert "it is for the host `partner`, which takes `--hosts FILE`" in text
    assert here.done == []


def test_levels_that_change_what_a_host_serves_are_refused_at_their_line(site: Site) -> None:
    path = site.folder / "experiment.yaml"
    path.write_text(FILE.replace("fast: {components.here", "fast: {components.far"))
    with (
        site.serving("partner", "near", "far", "apart"),
        pytest.raises(ScenarioError) as refused,
    ):
        load_experiment(path, hosts=read_hosts(site.hosts))
    what = "`far` is on a host, which serves it to all runs alike; vary what is here"
    assert str(refused.value) == f"{path}:7:44: components.far.parameters.rate: {what}"


def test_levels_must_not_move_components_between_hosts(site: Site) -> None:
    path = site.folder / "experiment.yaml"
    path.write_text(
        FILE.replace("{components.here.parameters.rate: 9}", "{components.here.host: partner}")
    )
    with (
        site.serving("partner", "near", "far", "apart"),
        pytest.raises(
            ScenarioError, match="`here` is on a host, which serves it to all runs alike"
        ),
    ):
        load_experiment(path, hosts=read_hosts(site.hosts))


def test_settings_of_all_runs_are_compared_with_those_of_the_host(site: Site) -> None:
    path = site.folder / "experiment.yaml"
    path.write_text(FILE.replace("factors:", "set: {components.far.parameters.rate: 3}\nfactors:"))
    hosts = read_hosts(site.hosts)
    with (
        site.serving("partner", "near", "far", "apart"),
        pytest.raises(ScenarioError, match="with what `--set` says, it differs in"),
    ):
        load_experiment(path, hosts=hosts)
    set_there = ["components.far.parameters.rate=3"]
    with site.serving("partner", "near", "far", "apart", overrides=set_there):
        assert load_experiment(path, hosts=hosts).hosts == site.hosts


def test_a_host_that_is_not_there_is_waited_for(site: Site) -> None:
    told: list[str] = []
    text = site.scenario.read_text().replace(
        "host: partner", "host: partner, deadline: {setup: 0.3}"
    )
    site.scenario.write_text(text)
    path = site.folder / "experiment.yaml"
    with pytest.raises(ComponentError, match="nobody answers at host `partner`"):
        load_experiment(path, hosts=read_hosts(site.hosts), tell=told.append)
    assert told[0].startswith("waiting for `near`: nobody answers at host `partner`")


@pytest.mark.parametrize("given", [["--workers", "2"], ["--scheduler", "tcp://127.0.0.1:1"]])
def test_a_host_serves_one_run_at_a_time(
    site: Site, capsys: pytest.CaptureFixture[str], given: list[str]
) -> None:
    code, _, text = said(capsys, site, "out", "--hosts", site.hosts, *given)
    assert code == 2
    assert f"a host serves one run at a time; with --hosts leave {given[0]} out" in text


def test_the_command_that_repeats_a_run_names_the_hosts_file(site: Site) -> None:
    with site.serving("partner", "near", "far", "apart"):
        path = site.folder / "experiment.yaml"
        experiment = load_experiment(path, hosts=read_hosts(site.hosts))
    assert f"--hosts {site.hosts}" in experiment.command(RunKey(1, 0))
