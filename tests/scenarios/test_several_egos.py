"""Ego vehicles of one scenario have units of their own; what they share is the road and the air."""

from pathlib import Path

import pytest

import scenarios
from orchestrator.cli import main
from orchestrator.recording import Recording

SCENARIO = Path(scenarios.__file__).parent / "several_egos.yaml"
TRAFFIC = "components.traffic.parameters"
ALONE = ("each.ego=[south]", f"{TRAFFIC}.entities.north=null")
BOTH = ("each.ego=[south, north]", f"{TRAFFIC}.entities.north.enters=0 s")
FAR = "components.channel.parameters.transmit_power=-20 dBm"
"""Reaches no vehicle of the other arm of the road, 300 m away."""


def run(out: Path, *changes: str) -> Recording:
    common = ("time.stop=3 s", f"{TRAFFIC}.background=null", f"{TRAFFIC}.entities.follower=null")
    sets = [word for change in (*common, *changes) for word in ("--set", change)]
    brief = ("--no-figure", "--quiet", "--set", "measures={}")
    assert main(["run", str(SCENARIO), *sets, *brief, "--out", str(out)]) == 0
    return Recording(out)


def of_south(recording: Recording) -> dict[str, tuple[bytes, bytes]]:
    """Times and values of the signals that are of one ego or its units."""
    own = [name for name in recording.signals if "south" in name]
    values = {name: (recording[name].times, list(recording[name])) for name in own}
    return {
        name: (
            times.tobytes(),
            b"".join(each if isinstance(each, bytes) else each.tobytes() for each in samples),
        )
        for name, (times, samples) in values.items()
    }


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return run(tmp_path_factory.mktemp("alone") / "run", *ALONE, FAR)


def test_a_second_ego_out_of_sight_and_range_changes_no_byte_of_the_first(
    alone: Recording, tmp_path: Path
) -> None:
    expected = of_south(alone)
    found = of_south(run(tmp_path / "run", *BOTH, FAR))
    units = {name.partition(".")[0] for name in expected}
    assert units == {"traffic", "facilities", "own-south", "relay-south", "policy-south"}
    assert found.keys() == expected.keys()
    assert [name for name in expected if found[name] != expected[name]] == []


@pytest.mark.slow
def test_in_range_it_changes_what_the_radio_carries_and_nothing_else(tmp_path: Path) -> None:
    expected = of_south(run(tmp_path / "alone", *ALONE))
    found = of_south(run(tmp_path / "both", *BOTH))
    changed = [name for name in expected if found[name] != expected[name]]
    assert changed
    assert [name for name in changed if not name.startswith("facilities.south.received.")] == []
