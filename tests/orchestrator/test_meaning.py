"""Outputs are what connectors declare of them: in range, ascending, naming only who exists."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.connectors import SIGNALS
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.cli import main
from orchestrator.connection import Connection
from orchestrator.errors import ComponentError
from orchestrator.known_numbers import checks
from orchestrator.meaning import Meaning
from orchestrator.recording.reader import Recording
from orchestrator.remote.declarations import _connector, _describe
from orchestrator.signal import Causality, Connector
from orchestrator.simulation import simulate
from orchestrator.system import Endpoint, System
from orchestrator.testing import FunctionComponent
from tests.recordings import output, record

STEP = 100_000_000
NAMING = Meaning(names="vehicle", nobody=-1)
GIVING = Meaning(numbers="vehicle", minimum=0, is_ascending=True)
IDS = output("vehicle", dtype=np.int64, meaning=GIVING)
PRESENT = [[0, 1], [0, 1, 5], [1, 5], [1], [1]]
"""Numbers of vehicles at each communication point: 0 and 5 leave."""


@pytest.mark.parametrize(
    ("meaning", "value", "said"),
    [
        (Meaning(minimum=0, maximum=1), [0.0, 1.0], []),
        (Meaning(minimum=0), [0.0, -0.25, -1], ["is -0.25 at index [1], below the declared 0"]),
        (Meaning(maximum=1), [[0, 1], [1, 2]], ["is 2 at index [1, 1], above the declared 1"]),
        (Meaning(maximum=1), 1.5, ["is 1.5, above the declared 1"]),
        (Meaning(is_ascending=True), [1, 2, 9], []),
        (Meaning(items=(("off", 0), ("on", 4))), [4, 0, 0], []),
        (
            Meaning(items=(("off", 0), ("on", 4)), maximum=3),
            [[0, 4], [2, 9]],
            [
                "is 4 at index [0, 1], above the declared 3",
                "is 2 at index [1, 0], none of 0 off, 4 on",
            ],
        ),
        (Meaning(is_ascending=True), [], []),
        (Meaning(is_ascending=True), [1, 3, 3], ["does not ascend: 3 is followed by 3"]),
        (Meaning(is_ascending=True), [1, 4, 2, 3], ["does not ascend: 4 is followed by 2"]),
    ],
)
def test_range_and_order(meaning: Meaning, value: Any, said: list[str]) -> None:
    assert meaning.violations(np.array(value)) == said


def run(
    relays: list[int],
    *,
    source: Connector,
    target: Meaning | None = None,
    ids: Connector = IDS,
    before: Recording | None = None,
) -> None:
    """Simulate traffic whose vehicles come and go, and a relay that names one after another."""
    traffic = FunctionComponent(
        {"vehicle.id": ids}, lambda s, i, t: (None, {"vehicle.id": np.array(PRESENT[t // STEP])})
    )
    relay = FunctionComponent(
        {"relay": source}, lambda s, i, t: (None, {"relay": np.array(relays[t // STEP])})
    )
    reader = FunctionComponent(
        {"relay": replace(source, causality=Causality.INPUT, meaning=target)},
        lambda s, i, t: (None, {}),
    )
    system = System(
        {"traffic": traffic, "relay": relay, "facilities": reader},
        dict.fromkeys(("traffic", "relay", "facilities"), STEP),
        [Connection(Endpoint("relay", "relay"), Endpoint("facilities", "relay"))],
    )
    observers = checks(system, before)
    stop = (len(relays) - 1) * STEP
    simulate(system, Jacobi(), start=0, stop=stop, seed=0, observers=observers)


def scalar(meaning: Meaning | None = None) -> Connector:
    return output(dtype=np.int64, meaning=meaning)


def test_who_is_there_or_was_there_may_be_named_and_nobody_too() -> None:
    run([-1, 5, 0, 5, 1], source=scalar(NAMING))


@pytest.mark.parametrize(("relays", "time", "number"), [([0, 0, 7], 0.2, 7), ([5, 0], 0, 5),
                                                        ([0, -2], 0.1, -2)])  # fmt: skip
def test_who_was_never_there_ends_the_run(relays: list[int], time: float, number: int) -> None:
    """5 enters at 0.1 s only."""
    with pytest.raises(ComponentError) as caught:
        run(relays, source=scalar(NAMING))
    count = 2 if time == 0 else 3
    assert str(caught.value) == (
        f"component `relay` at t = {time} s: output `relay` is {number}, and there has been no "
        f"vehicle of this number ({count} until now)"
    )


def test_an_input_that_knows_what_it_reads_is_enough() -> None:
    what = r"output `relay`, which `facilities\.relay` reads, is 7, and there has been no vehicle"
    with pytest.raises(ComponentError, match=what):
        run([0, 7], source=scalar(), target=NAMING)
    run([0, 7], source=scalar())


def test_where_nobody_gives_numbers_nobody_is_unknown() -> None:
    run([0, 7], source=scalar(NAMING), ids=output("vehicle", dtype=np.int64))


def test_a_run_that_goes_on_knows_whom_it_had(tmp_path: Path) -> None:
    samples = [{"vehicle.id": np.array(each)} for each in ([7], [9])]
    before = record(tmp_path / "a", {"vehicle.id": IDS}, samples, component="traffic")
    run([7, 9, 5], source=scalar(NAMING), before=before)
    with pytest.raises(ComponentError, match="is 8, and there has been no vehicle"):
        run([7, 8], source=scalar(NAMING), before=before)
    other = record(tmp_path / "b", {"x": output()}, [{"x": np.array(0.0)}], component="traffic")
    run([7, 8], source=scalar(NAMING), before=other)


@pytest.mark.parametrize(
    ("value", "said"),
    [([0, 2, 1], "does not ascend: 2 is followed by 1"), ([-3], "is -3 at index [0], below")],
)
def test_an_output_out_of_its_range_or_order_ends_the_run(value: list[int], said: str) -> None:
    traffic = FunctionComponent(
        {"vehicle.id": IDS}, lambda s, i, t: (None, {"vehicle.id": np.array(value)})
    )
    system = System({"traffic": traffic}, {"traffic": STEP}, [])
    with pytest.raises(ComponentError) as caught:
        simulate(system, Jacobi(), start=0, stop=STEP, seed=0)
    assert f"output `vehicle.id` {said}" in str(caught.value)


@pytest.mark.parametrize("meaning", [None, NAMING, GIVING, Meaning(maximum=0.5)])
def test_it_crosses_to_another_process(meaning: Meaning | None) -> None:
    assert _connector(_describe(output(meaning=meaning))).meaning == meaning


def test_relays_name_vehicles() -> None:
    assert SIGNALS["relay"].meaning == NAMING


@pytest.mark.parametrize("transport", ["in-process", "loopback"])
def test_a_relay_of_the_red_light_that_does_not_exist_is_refused_by_name(
    transport: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings: Mapping[str, str] = {
        "time.stop": "300 ms",
        "components.relay.type": "relay-forced",
        "components.relay.parameters": "{times: [200 ms], relays: [999]}",
        "components.lidar.parameters.azimuths": "64",
        "components.perception.parameters.azimuths": "64",
    }
    words = [f"--set={key}={value}" for key, value in settings.items()]
    common = ["--quiet", "--no-figure", "--transport", transport, "--out", str(tmp_path / "run")]
    assert main(["run", "red_light", *words, *common]) == 3
    said = " ".join(capsys.readouterr().err.split())
    assert (
        "component `relay` at t = 0.2 s: output `relay` is 999, and there has been no vehicle"
        in said
    )
