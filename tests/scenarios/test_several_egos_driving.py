"""Ego vehicles that networks drive: each on the features that reached it, and on no other's."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import scenarios
from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint, read_network
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.network import NetworkDriver, network_reads
from fmus.messages.features import FeaturesMessage, read_features
from orchestrator.cli import main
from orchestrator.recording import Recording
from orchestrator.signal import Array
from tests.fmus.driving.network.world import network

pytestmark = pytest.mark.slow

SCENARIO = Path(scenarios.__file__).with_name("several_egos_driving.yaml")
ENTITIES = "components.traffic.parameters.entities"
SOUTH, SHARER, FOLLOWER = 0, 2, 7
"""Numbers in the order of the declarations; four trucks and the collider have the others."""
SHARERS = {"south": {SHARER, FOLLOWER}, "follower": {SOUTH}}
"""Whom each ego asks: those across the crossing and behind it, and the ego in front of it."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A recorded run, and the network that drove."""

    checkpoint: Checkpoint
    recording: Recording

    @property
    def times(self) -> list[int]:
        """The communication points behind the steps of the policies [ns]."""
        return [int(t) for t in self.recording["policy-south.command"].times[1:]]

    def features(self, ego: str, time: int) -> bytes:
        """What had reached an ego."""
        return bytes(self.recording[f"facilities.{ego}.received.features"].at(time))

    def commands(self, ego: str) -> Array:
        """What an ego's policy commanded, shape (time, 3)."""
        series = self.recording[f"policy-{ego}.command"]
        return np.array([series.at(time) for time in self.times])

    def replayed(self, ego: str, *, hears: str) -> Array:
        """What the network commands in the place of `ego`, with what reached the ego `hears`."""
        driver = NetworkDriver(self.checkpoint, 30.0 / 3.6, 1_000_000_000)
        reads = network_reads(self.checkpoint.architecture)
        found = []
        for time in self.times:
            signals = {
                name: self.recording[f"traffic.{ego}.{name.removeprefix('ego.')}"].at(time)
                for name in reads
                if name.startswith("ego.")
            }
            signals["points"] = self.recording["lidar.points"].at(time)
            signals["received.features"] = self.features(hears, time)
            found.append(driver.command(Inputs.read(signals, reads), time))
        return np.array(found)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    """Two egos near to their sharers, and a network of random weights, which is never idle."""
    folder = tmp_path_factory.mktemp("driving")
    path, out = folder / "random.safetensors", folder / "run"
    network(Architecture(keypoints=32, features=256, spacing=6)).write(path)
    settings = (
        "time.stop=2 s",
        "each.ego=[south, follower]",
        f"{ENTITIES}.north=null",
        f"{ENTITIES}.south.position.to_end=80 m",
        f"{ENTITIES}.follower.position.to_end=120 m",
        f"components.encoder.parameters.network={path}",
        f"components.policy.parameters.network={path}",
        "recording.exclude=[]",
    )
    options = [word for setting in settings for word in ("--set", setting)]
    brief = ("--no-figure", "--quiet", "--set", "measures={}")
    assert main(["run", str(SCENARIO), *options, *brief, "--out", str(out)]) == 0
    return Drive(checkpoint=read_network(str(path)), recording=Recording(out))


def encoded(drive: Drive) -> dict[tuple[int, int], FeaturesMessage]:
    """What the encoder made of every scan, by vehicle and time of the scan."""
    return {
        (message.vehicle, message.time): message
        for sample in drive.recording["encoder.features"]
        for message in read_features(bytes(sample))
    }


@pytest.mark.parametrize("ego", SHARERS)
def test_an_ego_receives_the_scans_of_those_whom_it_asked_as_they_were_encoded(
    drive: Drive, ego: str
) -> None:
    """Of each the two newest, no number of them changed; ten or more of one of them in 2 s."""
    sent, asked = encoded(drive), set()
    scans: Counter[int] = Counter()
    for time in drive.times:
        asked.add(int(drive.recording[f"own-{ego}.match.sharer"].at(time)[0]))
        messages = read_features(drive.features(ego, time))
        of_each = Counter(message.vehicle for message in messages)
        assert of_each.keys() <= asked
        assert max(of_each.values(), default=0) <= 2
        for message in messages:
            expected = sent.pop((message.vehicle, message.time), None)
            if expected is None:
                continue  # compared when it was new
            assert message.keypoints.shape == (32, 259)
            assert message.keypoints.tobytes() == expected.keypoints.tobytes()
            assert message.position.tolist() == expected.position.tolist()
            scans[message.vehicle] += 1
    assert scans.keys() == SHARERS[ego]
    assert max(scans.values()) >= 10


@pytest.mark.slow
@pytest.mark.parametrize(("ego", "other"), [("south", "follower"), ("follower", "south")])
def test_an_ego_is_driven_by_what_reached_it(drive: Drive, ego: str, other: str) -> None:
    """To the bit; what reached the other one would have driven it otherwise, and by far."""
    commands = drive.commands(ego)
    assert drive.replayed(ego, hears=ego).tobytes() == commands.tobytes()
    apart = np.abs(drive.replayed(ego, hears=other) - commands).max(axis=1)
    assert apart.max() > 0.1
    heard = [drive.features(ego, time) != drive.features(other, time) for time in drive.times]
    assert np.count_nonzero(apart) > 0.5 * sum(heard) > 10
