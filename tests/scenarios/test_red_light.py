"""The main job: the red-light study in a closed loop, as users run it."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

import scenarios
from orchestrator.cli import main
from orchestrator.recording import Recording
from studies.red_light.sharing_cost import sharing_cost

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
SEEDS = (1, 2, 3)
ANSWER = "components.facilities.parameters.answer"
Json = dict[str, Any]


BRIEFLY = ("--no-figure", "--set", "measures={}")
"""For runs of which the recording and the metrics of the report are wanted, and no more."""
FIVE_ELSEWHERE = ("--set", "components.channel.process=on-request")
"""With a transport, the channel runs in a process of its own, too: five of seven components do."""


def nlosim(*arguments: str | Path, capsys: pytest.CaptureFixture[str]) -> Json:
    """Run a command that must succeed; what it prints with `--json`."""
    capsys.readouterr()
    code = main([*map(str, arguments), "--json", "--quiet"])
    captured = capsys.readouterr()
    assert code == 0, captured.out + captured.err
    result: Json = json.loads(captured.out)
    return result


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_cooperative_perception_prevents_the_collision_that_the_blind_ego_has(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same seed, with and without V2X, where all of a scan is sent or what is demanded.

    The hidden vehicle lies in a blind zone when it matters; the rest need not be sent.
    """
    common = ("run", SCENARIO, "--seed", str(seed), *BRIEFLY)
    policy = "components.policy.type=policy-blind"
    blind = nlosim(*common, "--set", policy, "--out", tmp_path / "blind", capsys=capsys)
    assert blind["metrics"]["collision"]
    costs = {}
    for choice in ("all", "demanded"):
        out = tmp_path / choice
        # the first is what the scenario has anyhow
        asked = () if choice == "all" else ("--set", f"{ANSWER}={choice}")
        metrics = nlosim(*common, *asked, "--out", out, capsys=capsys)["metrics"]
        assert not metrics["collision"]
        assert metrics["min_gap_m"] > 1.0
        assert metrics["braking"]["object"] == metrics["hidden_vehicle"]["id"]
        assert metrics["hidden_vehicle"]["first_seen_by"] == "sharing node"
        assert metrics["hidden_vehicle"]["received_by_ego"] < metrics["braking"]["time"]
        assert metrics["braking"]["time"] < metrics["hidden_vehicle"]["seen_by_ego"]
        assert metrics["prr"]["end_to_end"] > metrics["prr"]["direct"]
        files = [path for path in (out / "signals").rglob("*") if path.is_file()]
        assert sum(path.stat().st_size for path in files) < 15_000_000
        costs[choice] = sharing_cost(Recording(out))
    assert costs["demanded"].data_bytes < costs["all"].data_bytes / 2


@pytest.mark.slow
def test_the_fingerprint_does_not_depend_on_where_components_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one process, through the loopback, and in processes over either transport.

    As users run it, and with the channel, too, in a process of its own.
    """
    ways: tuple[tuple[str, ...], ...] = (
        ("in-process",),
        ("local",),
        ("loopback", *FIVE_ELSEWHERE),
        ("local", *FIVE_ELSEWHERE),
        ("zenoh", *FIVE_ELSEWHERE),
    )
    prints: dict[Path, str] = {}
    for where, *elsewhere in ways:
        out = tmp_path / str(len(prints))
        words: tuple[str | Path, ...]
        words = ("--transport", where, *elsewhere, "--set", "time.stop=9 s", "--out", out)
        prints[out] = nlosim("run", SCENARIO, *BRIEFLY, *words, capsys=capsys)["fingerprint"]
    assert len(set(prints.values())) == 1, prints
    manifests = [json.loads((out / "manifest.json").read_text()) for out in prints]
    remote = [
        sum(bool(each.get("process")) for each in manifest["scenario"]["components"].values())
        for manifest in manifests
    ]
    assert remote == [4, 4, 5, 5, 5]


@pytest.mark.slow
def test_users_get_a_figure_and_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    nlosim("run", SCENARIO, "--set", "time.stop=1 s", "--out", out, capsys=capsys)
    assert (out / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "measures.svg").stat().st_size > 0
    assert (out / "index.html").stat().st_size > 0


@pytest.mark.slow
def test_the_blocking_vehicles_obstruct_the_direct_link_when_the_ego_approaches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Free far away, obstructed on the approach: what makes the relay necessary."""
    direct = nlosim(
        "run",
        SCENARIO,
        *BRIEFLY,
        "--set",
        "components.relay.type=relay-direct",
        "--set",
        "time.stop=14 s",
        "--out",
        tmp_path / "direct",
        capsys=capsys,
    )
    (link,) = direct["metrics"]["links"]
    assert link["prr"] == direct["metrics"]["prr"]["end_to_end"] < 0.6
    assert link["classes"]["NLOSv"] > link["classes"]["LOS"]


def test_two_runs_are_equal_and_another_seed_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    prints = [
        nlosim(
            "run",
            SCENARIO,
            *BRIEFLY,
            "--seed",
            str(seed),
            "--set",
            "time.stop=1 s",
            "--out",
            tmp_path / str(k),
            capsys=capsys,
        )["fingerprint"]
        for k, seed in enumerate((1, 1, 2))
    ]
    assert prints[0] == prints[1] != prints[2]


@pytest.mark.slow
def test_the_scenario_in_the_manifest_repeats_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Overrides applied, defaults written out, seeds still drawn from the scenario's seed."""
    out = tmp_path / "first"
    overrides = (*BRIEFLY, "--seed", "7", "--set", "time.stop=2 s")
    first = nlosim("run", SCENARIO, *overrides, "--out", out, capsys=capsys)
    resolved = json.loads((out / "manifest.json").read_text())["scenario"]
    again = tmp_path / "again.yaml"
    again.write_text(yaml.safe_dump(resolved, sort_keys=False))  # entities are in an order
    second = nlosim("run", again, *BRIEFLY, "--out", tmp_path / "second", capsys=capsys)
    assert second["fingerprint"] == first["fingerprint"]


def started(out: Path, *arguments: str) -> subprocess.Popen[str]:
    """A long run in a process of its own, once it has recorded something."""
    command = [sys.executable, "-m", "orchestrator", "run", str(SCENARIO), "--out", str(out)]
    process = subprocess.Popen(
        [*command, "--quiet", "--set", "time.stop=1000 s", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    index = out / "signals" / "index.json"
    deadline = time.monotonic() + 60
    while not (index.exists() and len(Recording(out)["channel.receptions"]) > 10):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def hosts_of(parent: int) -> dict[str, int]:
    """The component processes of a run, which is a child of `parent`: command to process id."""
    (run,) = children_of(parent).values()
    return children_of(run)


def children_of(parent: int) -> dict[str, int]:
    """The processes that one has started: command to process id."""
    found = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            status = (entry / "status").read_text()
            words = (entry / "cmdline").read_bytes().decode().split("\0")
        except OSError:
            continue
        if re.search(rf"^PPid:\s+{parent}$", status, re.MULTILINE):
            found[" ".join(words)] = int(entry.name)
    return found


def readable_until(out: Path) -> int:
    """The last communication point of the recording; every signal must be readable."""
    recording = Recording(out)
    for name in recording.signals:
        series = recording[name]
        assert len(series) == len(series.times)
        series[len(series) - 1]
    return int(recording["channel.receptions"].times[-1])


@pytest.fixture
def run_directory(tmp_path: Path) -> Path:
    return tmp_path / "run"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")
@pytest.mark.parametrize("transport", ["local", "zenoh"])
def test_a_killed_component_ends_the_run_by_name_and_time(
    run_directory: Path, transport: str
) -> None:
    process = started(run_directory, "--transport", transport, *FIVE_ELSEWHERE)
    hosts = hosts_of(process.pid)
    assert len(hosts) == 5
    (victim,) = (pid for words, pid in hosts.items() if "perception" in words)
    os.kill(victim, signal.SIGKILL)
    killed = time.monotonic()
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 3
    assert time.monotonic() - killed < 5  # measured: half a second; CI machines are noisy
    message = re.search(r"component `perception` at t = ([0-9.]+) s: .*SIGKILL", errors)
    assert message is not None, errors
    assert "Traceback" not in errors
    until = readable_until(run_directory)
    assert 0 < until < float(message[1]) * 1e9 + 100e6  # perception steps every 100 ms
    manifest = json.loads((run_directory / "manifest.json").read_text())
    assert manifest["status"] == "failed"
    assert all(not Path(f"/proc/{pid}").exists() for pid in hosts.values())


@pytest.mark.slow
def test_an_interrupted_run_keeps_what_it_recorded(run_directory: Path) -> None:
    process = started(run_directory)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 4
    assert str(run_directory) in errors
    assert "Traceback" not in errors
    assert readable_until(run_directory) > 0
    manifest = json.loads((run_directory / "manifest.json").read_text())
    assert manifest["status"] == "interrupted"
