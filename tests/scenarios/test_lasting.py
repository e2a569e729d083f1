"""The red lights whose obstruction lasts: who sees and hears whom when the ego must decide."""

from pathlib import Path

import numpy as np
import pytest

from fmus.messages.records import LINKS, OUTCOMES, RECEPTION, SENSOR_DATA
from studies.measures.radio import batches
from tests.scenarios.encounter import EGO, SHARER, Run, run

NAMES = ["red_light_turning", "red_light_beside", "red_light_opposing"]
NO_NETWORK = 'components.encoder.parameters.network=""'
DIRECT = "components.relay.type=relay-direct"
PROBE = "components.facilities.parameters.load=probe"
PERFECT = (
    "components.channel.type=channel-constant-per",
    "components.channel.parameters.per=0",
    "components.channel.parameters.range=1 km",
    "components.traffic.parameters.equipment.all.radio=0",
)


def frames(found: Run, begin: float, end: float) -> tuple[list[str], list[str]]:
    """Links and outcomes of the frames with scans from sharer to ego between two times [s]."""
    kinds = batches(found.recording, "channel.receptions", "RCPT", RECEPTION, "sensor_data")
    rows = np.concatenate([batch.records for batch in kinds])
    own = rows[(rows["transmitter"] == SHARER) & (rows["receiver"] == EGO)]
    own = own[(own["time"] > begin * 1e9) & (own["time"] <= end * 1e9)]
    assert set(own["kind"].tolist()) <= {SENSOR_DATA}
    return [LINKS[k] for k in own["link"]], [OUTCOMES[k] for k in own["outcome"]]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_direct_link_is_obstructed_when_the_blind_ego_must_decide(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the recording of the last second before the point of no return, seed 101."""
    changes = (DIRECT, PROBE, NO_NETWORK)
    blind = run(name, "policy-blind", 101, tmp_path / "blind", capsys, *changes)
    assert blind.metrics["collision_partner"] == "collision vehicle"
    had = blind.metrics["measures"]["decision"]
    end = had["no_return_s"]
    assert 1.0 < blind.metrics["collision_time"] - end < 2.5
    assert had["bodies_least"] >= 2
    assert had["obstructed"] == 1.0
    links, outcomes = frames(blind, end - 1.0, end)
    assert set(links) <= {"NLOSv"}
    assert "R" not in outcomes
    assert had["scans"] == 10
    assert had["scans_there"] == 0
    assert had["sent"] >= 9
    assert had["direct"] == 0.0

    assert had["in_sight"] == 0.0
    assert had["seen_before_s"] < -0.8
    rows = range(blind.before(end - 1.0).stop, blind.before(end).stop)
    assert not any(blind.sees(row, EGO, is_hidden_by_bodies=True) for row in rows)
    assert all(blind.sees(row, SHARER, is_hidden_by_bodies=True) for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_who_knows_everything_does_not_collide(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changes = (DIRECT, *PERFECT, NO_NETWORK)
    expert = run(name, "policy-expert", 101, tmp_path / "expert", capsys, *changes).metrics
    assert expert["success"]
    assert expert["min_gap_m"] > 2.0
    assert expert["measures"]["decision"]["braked_before_s"] > 0.0
