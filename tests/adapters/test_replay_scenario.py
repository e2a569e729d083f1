"""The page docs/traffic-replay.md is true: its example runs, and the road data drive all units."""

import json
import re
from collections import Counter
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from adapters.traffic.geometry import rotate
from fmus.messages.records import FRAME, OUTCOMES, POINT, RECEPTION, SENSOR, unframe
from orchestrator.cli import main
from orchestrator.recording import Recording

PAGE = Path(__file__).parents[2] / "docs" / "traffic-replay.md"


@pytest.fixture
def street(tmp_path: Path) -> Path:
    """The scenario of the page, with its files beside it."""
    blocks = re.findall(r"^```\w+ (\S+)\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)
    assert [name for name, _ in blocks] == ["street.csv", "street.poly.xml", "street.yaml"]
    for name, text in blocks:
        (tmp_path / name).write_text(text)
    return tmp_path / "street.yaml"


def run(scenario: Path, capsys: pytest.CaptureFixture[str], out: str, *options: str) -> str:
    words = ["run", str(scenario), "--out", str(scenario.parent / out), "--json", *options]
    assert main(words) == 0
    found: str = json.loads(capsys.readouterr().out)["fingerprint"]
    return found


@pytest.mark.slow
def test_the_example_runs_through_lidar_facilities_and_channel(
    street: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fingerprint = run(street, capsys, "a")
    recording = Recording(street.parent / "a")
    assert recording["traffic.entered"][0] == (
        b'[[0,"red car","passenger"],[1,"white van","delivery"],[2,"bus","bus"]]'
    )
    assert heard(recording) == dict.fromkeys(permutations(range(3), 2), pytest.approx(59, abs=2))
    assert seen(recording) > 1000
    assert run(street, capsys, "b", "--transport", "loopback") == fingerprint


def heard(recording: Recording) -> dict[tuple[int, int], int]:
    """How many BSMs, of one each 100 ms for 6 s, arrived from whom at whom."""
    rows = np.concatenate(
        [unframe("RCPT", bytes(each), RECEPTION) for each in recording["channel.receptions"]]
    )
    received = rows[rows["outcome"] == OUTCOMES.index("R")]
    pairs = zip(received["transmitter"].tolist(), received["receiver"].tolist(), strict=True)
    return dict(Counter(pairs))


def seen(recording: Recording) -> int:
    """How many points the red car's lidar has on the van; all are on its surface, 3.25 m and 1.08 m
    around (-20, -2), but for the noise of the range, 2 cm."""
    count = 0
    for scan in recording["lidar.points"]:
        data = bytes(scan)
        sensor = unframe("LPTS", data, SENSOR)[0]
        assert sensor["vehicle"] == 0
        first = FRAME.itemsize + 3 * SENSOR.itemsize
        points = np.frombuffer(data, POINT, offset=first)[sensor["first"] :][: sensor["count"]]
        van = points["position"][points["instance"] == 1]
        van = rotate(van[:, :2].astype(float), np.array(sensor["heading"])) + sensor["position"][:2]
        assert (np.abs(van - [-20.0, -2.0]) <= [3.25 + 0.12, 1.08 + 0.12]).all()
        count += len(van)
    return count
