"""`nlosim trace`, on runs as users make them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenarios
from fmus.messages.records import OUTCOMES, RECEPTION, unframe
from orchestrator.cli import main
from orchestrator.recording import Recording
from orchestrator.signal import Array

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")


def nlosim(*arguments: str | Path, capsys: pytest.CaptureFixture[str], code: int = 0) -> Any:
    """What a command prints with `--json`."""
    capsys.readouterr()
    found = main([*map(str, arguments), "--json"])
    captured = capsys.readouterr()
    assert found == code, captured.out + captured.err
    return json.loads(captured.out)


def receptions(directory: Path) -> Array:
    """All receptions of a run, by packet, hop and receiver."""
    samples = [bytes(x) for x in Recording(directory)["channel.receptions"]]
    rows = np.concatenate([unframe("RCPT", sample, RECEPTION) for sample in samples])
    return rows[np.lexsort([rows[key] for key in ("receiver", "hop", "packet")])]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Half a second of the red-light study with its native channel."""
    out = tmp_path_factory.mktemp("runs") / "run"
    command = ["run", str(SCENARIO), "--set", "time.stop=500 ms", "--out", str(out), "--quiet"]
    assert main([*command, "--no-figure"]) == 0
    return out


def replayed(run: Path, trace: Path, missing: str, capsys: pytest.CaptureFixture[str]) -> Array:
    """The receptions of the same scenario over a trace."""
    scenario = trace.with_name("replay.yaml")
    scenario.write_text(f"""
schema: 1
extends: {SCENARIO}
title: Replay
components:
  channel:
    type: channel-trace
    parameters: {{file: {trace.name}, tolerance: 0 s, missing: {missing}}}
""")
    out = trace.with_name("replay")
    stop = ("--set", "time.stop=500 ms", "--no-figure", "--quiet")
    nlosim("run", scenario, *stop, "--out", out, capsys=capsys)
    return receptions(out)


@pytest.mark.slow
def test_a_replay_of_the_outcomes_repeats_the_run(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Closed loop: the same packets are sent because the same were received, at the same times.

    The channel drops what would have ended after its receiver has left; the replay tells of it.
    """
    trace = tmp_path / "links.csv"
    told = nlosim("trace", run, "--out", trace, "--kind", "outcome", capsys=capsys)
    before, after = receptions(run), replayed(run, trace, "lost", capsys)
    assert told["rows"] == len(before) > 10_000
    assert set(np.unique(before["outcome"])) >= {OUTCOMES.index(letter) for letter in "RNCTU"}
    keys = ["packet", "hop", "receiver"]
    both = np.isin(after[keys], before[keys])
    assert after[both].tobytes() == before.tobytes()
    assert set(after[~both]["outcome"].tolist()) <= {OUTCOMES.index("U")}


def test_error_rates_of_a_run_count_its_losses(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "links.csv"
    nlosim("trace", run, "--out", trace, "--bin", "1", "--between", "0,2,7", capsys=capsys)
    remark, header, *rows = trace.read_text().splitlines()
    assert remark == f"# nlosim trace {run} --out links.csv --kind per --bin 1 --between 0,2,7"
    assert header == "time,transmitter,receiver,per,power_dbm,link"
    heard = receptions(run)
    for row in rows:
        time, transmitter, receiver, per, *_ = row.split(",")
        link = heard[
            (heard["transmitter"] == int(transmitter)) & (heard["receiver"] == int(receiver))
        ]
        assert time == "0"
        assert float(per) == pytest.approx((link["outcome"] != 0).mean(), abs=1e-6)
    assert len(rows) == 6


def test_parquet_says_the_same_as_csv(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow", reason="needs the extra `parquet`")
    from fmus.channel.stand_ins.table import read_table  # noqa: PLC0415 - next to what needs it

    tables = {}
    for name in ("links.csv", "links.parquet"):
        path = tmp_path / name
        nlosim("trace", run, "--out", path, "--between", "0,2", capsys=capsys)
        columns = read_table(path).columns
        tables[name] = {n: [str(c) for c in columns[n]] for n in ("link", "receiver")}
        tables[name] |= {n: [f"{float(c or 0):.6f}" for c in columns[n]] for n in ("time", "per")}
    assert tables["links.csv"] == tables["links.parquet"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--component", "chanel"), "has no signal `chanel.receptions`; did you mean"),
        (("--component", "facilities"), "has no signal `facilities.receptions`"),
        (("--bin", "0"), "`0` is no positive number of seconds"),
        (("--bin", "nan"), "`nan` is no positive number of seconds"),
        (("--bin", "1e-10"), "a whole number of nanoseconds"),
        (("--between", "1;2"), "`1;2` is no list of numbers of vehicles, as in 3,17"),
        (("--kind", "pre"), "invalid choice: 'pre'"),
    ],
)
def test_wrong_arguments_and_runs_without_receptions_are_refused(
    run: Path,
    tmp_path: Path,
    arguments: tuple[str, ...],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "links.csv"
    found = nlosim("trace", run, "--out", out, *arguments, capsys=capsys, code=2)
    assert message in found["error"]["message"]
    assert not out.exists()


def test_a_directory_without_a_recording_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = nlosim("trace", tmp_path, "--out", tmp_path / "x.csv", capsys=capsys, code=2)
    assert "holds no recording" in found["error"]["message"]


def test_the_shipped_recording_says_how_it_was_made() -> None:
    shipped = SCENARIO.parent / "assets" / "red_light" / "links.csv"
    remark = shipped.read_text().splitlines()[0].removeprefix("# ")
    assert remark in (shipped.parent / "README.md").read_text()


@pytest.mark.slow
def test_a_scenario_with_a_wrong_recording_is_refused_by_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "links.csv"
    trace.write_text("time,transmitter,receiver,per\n0,1,2,2\n1,1,2,nan\n")
    scenario = tmp_path / "replay.yaml"
    scenario.write_text(f"""
schema: 1
extends: {SCENARIO}
components:
  channel: {{type: channel-trace, parameters: {{file: links.csv}}}}
""")
    found = nlosim("check", scenario, capsys=capsys, code=2)
    message = "\n".join(problem["message"] for problem in found["problems"])
    assert f"{trace}:2:7: `per`: `2` is no number between 0 and 1" in message
    assert f"{trace}:3:7: `per`: `nan` is no number between 0 and 1" in message
