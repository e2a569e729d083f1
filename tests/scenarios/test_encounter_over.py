"""A run that ends with the encounter is the beginning of the one that goes on."""

import json
from pathlib import Path
from typing import Any

import pytest

import scenarios
from orchestrator.cli import main
from orchestrator.recording import Recording

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
SHORT = (
    "components.traffic.parameters.entities.ego.position.to_end=60 m",
    "components.policy.type=policy-blind",
    "time.stop=12 s",
)
UNTIL = "time.until=traffic.encounter.over"


def run(
    capsys: pytest.CaptureFixture[str], out: Path, *settings: str, transport: str = "in-process"
) -> dict[str, Any]:
    """What `--json` prints, and the manifest, of a run that must succeed."""
    arguments = ["run", str(SCENARIO), "--json", "--quiet", "--no-figure", "--out", str(out)]
    for setting in (*SHORT, "measures={}", *settings):
        arguments += ["--set", setting]
    capsys.readouterr()
    code = main([*arguments, "--transport", transport])
    captured = capsys.readouterr()
    assert code == 0, captured
    found: dict[str, Any] = json.loads(captured.out)
    return {**found, "manifest": json.loads((out / "manifest.json").read_text())}


@pytest.mark.slow
def test_the_run_ends_with_the_collision_and_metrics_have_its_time_and_partner(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = run(capsys, tmp_path / "run", UNTIL)
    metrics, reached = found["metrics"], found["manifest"]["reached_ns"] / 1e9
    assert metrics["collision"]
    assert metrics["collision_partner"] == "collision vehicle"
    assert reached - 0.05 < metrics["collision_time"] <= reached < 12.0
    assert metrics["completion_time"] is None
    assert not metrics["success"]
    assert found["simulated_s"] == pytest.approx(reached)
    over = Recording(tmp_path / "run")["traffic.encounter.over"].values
    assert over.tolist() == [False] * (len(over) - 1) + [True]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coupling", "transports"),
    [
        ("{}", ["in-process", "loopback", "local", "zenoh"]),
        ("{algorithm: jacobi}", ["in-process", "local"]),
    ],
    ids=["gauss-seidel", "jacobi"],
)
def test_it_is_the_run_that_stops_there_wherever_components_run(
    coupling: str, transports: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every recorded byte and every metric: rates are those until the end that there was.

    In one process, through the loopback, and with five components in processes over either
    transport. Traffic steps every 100 ms here, like the others, so that `time.stop` can be set to
    that time.
    """
    common = (
        "components.traffic.step=100 ms",
        "components.channel.process=on-request",
        f"coupling={coupling}",
    )
    runs = [
        run(capsys, tmp_path / transport, *common, UNTIL, transport=transport)
        for transport in transports
    ]
    components = runs[-1]["manifest"]["scenario"]["components"].values()
    assert sum(bool(each.get("process")) for each in components) == 5
    stop = f"time.stop={runs[0]['manifest']['reached_ns']} ns"
    runs.append(run(capsys, tmp_path / "stopped", *common, stop))
    assert len({each["fingerprint"] for each in runs}) == 1
    assert all(each["metrics"] == runs[0]["metrics"] for each in runs)


@pytest.mark.slow
def test_it_ends_where_the_ego_is_through(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nobody = ("components.traffic.parameters.entities.collider=null", "time.stop=20 s")
    found = run(capsys, tmp_path / "run", UNTIL, *nobody)
    metrics, reached = found["metrics"], found["manifest"]["reached_ns"] / 1e9
    assert metrics["success"]
    assert not metrics["collision"]
    assert metrics["collision_time"] is metrics["collision_partner"] is None
    assert reached - 0.05 < metrics["completion_time"] <= reached < 20.0
