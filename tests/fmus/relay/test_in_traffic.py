"""Relay policies in the red-light scenario: the same run again, and nothing but what was told."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenarios
from fmus.messages.records import NO_VEHICLE, OBJECT, frame, unframe
from fmus.relay import ExpectedPrr, Mohed
from fmus.relay.connectors import CONNECTORS
from orchestrator.cli import main
from orchestrator.component import Component
from orchestrator.recording import Recording, Series
from orchestrator.signal import Causality
from tests.fmus.relay.world import Inputs

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
BRIEFLY = ("--no-figure", "--quiet", "--set", "measures={}")


def run(relay: str, out: Path) -> Recording:
    policy, stop = f"components.relay.type={relay}", "time.stop=10 s"
    command = ["run", str(SCENARIO), "--set", policy, "--set", stop, "--out", str(out)]
    assert main([*command, *BRIEFLY]) == 0
    return Recording(out)


@pytest.mark.slow
@pytest.mark.parametrize("relay", ["relay-expected-prr", "relay-mohed", "relay-random"])
def test_the_same_seed_gives_the_same_relays(relay: str, tmp_path: Path) -> None:
    first, second = (run(relay, tmp_path / name) for name in ("first", "second"))
    assert first.fingerprint() == second.fingerprint()


@pytest.mark.slow
def test_signal_strength_takes_the_same_neighbours_whose_hops_the_ego_was_told(
    tmp_path: Path,
) -> None:
    recording, again = (run("relay-signal-strength", tmp_path / name) for name in ("one", "two"))
    assert recording.fingerprint() == again.fingerprint()
    relays = _vehicles(recording["relay.relay"]) - {NO_VEHICLE}
    assert relays
    assert relays <= _vehicles(recording["facilities.received.link.receiver"])
    assert relays <= _vehicles(recording["facilities.received.link.transmitter"])


POLICIES: Mapping[str, Callable[[], Component]] = {
    "relay-expected-prr": lambda: ExpectedPrr(ExpectedPrr.Parameters()),
    "relay-mohed": lambda: Mohed(Mohed.Parameters()),
}
SOURCES = {"objects": "perception", "match": "perception", "received": "facilities"}
H = 100_000_000
Edit = Callable[[Inputs], Inputs]


@pytest.fixture(scope="module", params=POLICIES)
def policy(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@dataclass(frozen=True, slots=True)
class Run:
    """What the ego knew at each communication point of a run, and the relays it chose."""

    known: list[Inputs]
    chosen: list[int]


@pytest.fixture(scope="module")
def traffic(policy: str, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """14 s in which every message that arrives is one of the channel's."""
    out = tmp_path_factory.mktemp("run") / policy
    command = ["run", str(SCENARIO), "--set", f"components.relay.type={policy}"]
    assert main([*command, *BRIEFLY, "--set", "time.stop=14 s", "--out", str(out)]) == 0
    recording = Recording(out)
    names = [n for n, c in CONNECTORS.items() if c.causality is Causality.INPUT]
    signals = {n: f"{SOURCES.get(n.split('.')[0], 'traffic')}.{n}" for n in names}
    series = {n: recording[signal] for n, signal in signals.items() if signal in recording}
    start = {n: connector.start_value() for n, connector in CONNECTORS.items()}
    times = range(H, 14_000_000_001, H)
    return Run(
        known=[{**start, **{n: one.at(t) for n, one in series.items()}} for t in times],
        chosen=[int(np.asarray(recording["relay.relay"].at(t))) for t in times],
    )


def _replayed(traffic: Run, policy: str, edit: Edit = lambda known: known) -> list[int]:
    """The choices of a new policy that is given what the ego knew, after an `edit`."""
    component = POLICIES[policy]()
    component.setup(0, np.random.default_rng(0))
    relays = []
    for step, known in enumerate(traffic.known):
        component.step(edit(known), step * H, H)
        relays.append(int(np.asarray(component.outputs()["relay"])))
    return relays


def _without_foreign_truth(known: Inputs) -> Inputs:
    """Objects of other vehicles' sensors are in the signal; the ego must not know them."""
    rows = unframe("OBJS", bytes(known["objects"]), OBJECT).copy()
    foreign = rows["sensor"] != int(np.asarray(known["ego.id"]))
    rows["size"][foreign] -= 2.0
    rows["angle"][foreign] += 0.5
    rows["height"][foreign] = 9.0
    rows["instance"][foreign] += 1000
    return known | {"objects": frame("OBJS", rows)}


def _neighbours_kept(known: Inputs, keep: Any) -> Inputs:
    """Only the BSMs of some vehicles; the others' tell no powers either."""
    kept = keep(np.asarray(known["received.bsm.id"]))
    bsms = {n: np.asarray(v)[kept] for n, v in known.items() if n.startswith("received.bsm.")}
    link = keep(np.asarray(known["received.link.receiver"]))
    link &= keep(np.asarray(known["received.link.transmitter"]))
    links = {n: np.asarray(v)[link] for n, v in known.items() if n.startswith("received.link.")}
    return known | bsms | links


@pytest.mark.slow
def test_the_choice_follows_from_the_inputs_alone(traffic: Run, policy: str) -> None:
    """A new policy, given the declared inputs and not the world, chooses the same again."""
    assert len(set(traffic.chosen)) > 1
    assert _replayed(traffic, policy) == traffic.chosen


@pytest.mark.slow
def test_what_other_vehicles_see_is_not_known(traffic: Run, policy: str) -> None:
    assert _replayed(traffic, policy, _without_foreign_truth) == traffic.chosen


@pytest.mark.slow
def test_without_bsms_there_is_the_direct_link(traffic: Run, policy: str) -> None:
    relays = _replayed(traffic, policy, lambda k: _neighbours_kept(k, lambda v: v < -1))
    assert set(relays) == {NO_VEHICLE}


@pytest.mark.slow
def test_only_who_was_heard_is_chosen(traffic: Run, policy: str) -> None:
    """Half of the neighbours fall silent; the relays that were chosen are among them."""
    sharers = [int(np.asarray(known["match.sharer"])[0]) for known in traffic.known]
    chosen = set(traffic.chosen) - {NO_VEHICLE}

    def keep(vehicle: Any) -> Any:
        silent = (vehicle % 2 == 0) | np.isin(vehicle, sorted(chosen))
        return ~silent | np.isin(vehicle, sharers)

    relays = set(_replayed(traffic, policy, lambda k: _neighbours_kept(k, keep)))
    assert relays - {NO_VEHICLE}
    assert not relays & chosen
    assert all(relay % 2 for relay in relays - {NO_VEHICLE})


def _without_powers(known: Inputs) -> Inputs:
    """Nobody has measured anything."""
    links = {n: np.asarray(v)[:0] for n, v in known.items() if n.startswith("received.link.")}
    return known | links


@pytest.mark.slow
def test_without_apms_and_lidar_bsms_still_give_relays(traffic: Run, policy: str) -> None:
    """What is left are the neighbours' own bodies; trucks without a radio are not known then.

    Measured powers still tell of them to who uses powers; without these too, choices differ.
    """
    blind: Inputs = {"received.apms": b"", "objects": b""}
    edits: list[Edit] = [
        lambda known: known | {"received.apms": b""},
        lambda known: known | {"objects": b""},
        lambda known: known | blind,
        lambda known: _without_powers(known | blind),
    ]
    relays = [_replayed(traffic, policy, edit) for edit in edits]
    heard = {int(v) for known in traffic.known for v in np.asarray(known["received.bsm.id"])}
    assert all(set(choices) <= heard | {NO_VEHICLE} for choices in relays)
    assert relays[3] != traffic.chosen


def _vehicles(series: Series) -> set[int]:
    """All that the signal ever named."""
    return {int(v) for k in range(len(series)) for v in np.atleast_1d(np.asarray(series[k]))}
