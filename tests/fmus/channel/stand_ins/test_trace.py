"""The replay of recorded links, of single outcomes and of whole runs."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.channel.stand_ins import ConstantPer, Trace
from fmus.channel.stand_ins.recorded import Events, error_rates, outcomes as outcome_columns, write
from fmus.channel.stand_ins.rows import NO_ROW, LinkRows
from fmus.messages.records import NO_VEHICLE
from orchestrator.errors import ComponentTypeError
from orchestrator.testing import check_component
from tests.fmus.channel.harness import MS, packet, packets
from tests.fmus.channel.stand_ins.harness import Run, outcomes, row_of, scene

RATES = "time,transmitter,receiver,per\n"
OUTCOMES = "time,transmitter,receiver,outcome\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "links.csv"


def replay(file: Path, text: str = "", **parameters: Any) -> Run:
    if text:
        file.write_text(text)
    return Run(Trace(Trace.Parameters(file=file, **parameters)))


def letters(run: Run, times: list[float], receivers: int = 2) -> list[str]:
    """The outcomes at 1, 2, ... of broadcasts of vehicle 0 at `times` [ms], one word per frame."""
    sent = packets(packet(k, 0, time=round(t * MS)) for k, t in enumerate(times))
    run.steps(scene(row_of(receivers + 1)), sent, h=50 * MS, until=500 * MS)
    found = outcomes(run.receptions)
    return ["".join(found[k, 0, v] for v in range(1, receivers + 1)) for k in range(len(times))]


@pytest.mark.parametrize("per", [0.0, 0.3, 0.85, 1.0])
def test_a_constant_rate_gives_that_share_of_losses(file: Path, per: float) -> None:
    run = replay(file, RATES + f"0,0,1,{per}\n")
    words = letters(run, [k / 10 for k in range(4000)], receivers=1)
    lost = words.count("N")
    assert words.count("R") == 4000 - lost
    assert abs(lost / 4000 - per) <= 4 * math.sqrt(per * (1 - per) / 4000)


def test_a_constant_rate_loses_the_frames_that_the_constant_per_loses(file: Path) -> None:
    """One seed, one draw per frame and receiver, whatever decides."""
    sent = packets(packet(k, 0, time=k * MS) for k in range(100))
    constant = Run(ConstantPer(ConstantPer.Parameters(per=0.4)))
    constant.steps(scene(row_of(2)), sent, h=10 * MS, until=110 * MS)
    recorded = replay(file, RATES + "0,0,1,0.4\n")
    recorded.steps(scene(row_of(2)), sent, h=10 * MS, until=110 * MS)
    assert outcomes(recorded.receptions) == outcomes(constant.receptions)


def test_a_rate_holds_until_the_next_of_its_link(file: Path) -> None:
    rows = "0.1,0,1,0\n0.2,0,1,1\n0.3,0,1,0\n0.15,0,2,1\n0.25,0,2,0\n"
    run = replay(file, RATES + rows)
    words = letters(run, [99, 100, 199, 200, 249, 250, 300, 400])
    assert words == ["UU", "RU", "RN", "NN", "NN", "NR", "RR", "RR"]


def test_links_have_directions(file: Path) -> None:
    run = replay(file, RATES + "0,0,1,0\n0,1,0,1\n")
    run.step(scene(row_of(2)), packets([packet(0, 0), packet(1, 1)]))
    assert outcomes(run.receptions) == {(0, 0, 1): "R", (1, 0, 0): "N"}


@pytest.mark.parametrize(("missing", "letter"), [("lost", "U"), ("received", "R")])
@pytest.mark.parametrize("text", [RATES + "0.1,0,1,1\n", OUTCOMES + "0.3,0,1,N\n"])
def test_what_was_not_recorded_is_as_the_parameter_says(
    file: Path, text: str, missing: str, letter: str
) -> None:
    assert letters(replay(file, text, missing=missing), [50]) == [letter * 2]


@pytest.mark.parametrize("text", [RATES + "0.1,0,1,1\n", OUTCOMES + "0.3,0,1,N\n"])
def test_what_was_not_recorded_can_be_an_error(file: Path, text: str) -> None:
    run = replay(file, text, missing="error")
    with pytest.raises(
        ValueError, match=r"nothing about the link 0 -> 1 at 0.05 s \(packet 0, hop"
    ):
        letters(run, [50])


def test_an_outcome_is_applied_to_the_nearest_frame_and_once(file: Path) -> None:
    rows = "0.1,0,1,N\n0.2,0,1,C\n0.3,0,1,R\n0.1,0,2,R\n0.2,0,2,B\n0.3,0,2,T\n"
    shifted = letters(replay(file, OUTCOMES + rows), [130, 230, 330])
    assert shifted == ["NR", "CB", "RT"]
    # two frames near 0.1: the second gets the next one that is left; the third finds nothing
    crowded = letters(replay(file, OUTCOMES + rows), [90, 110, 115], receivers=1)
    assert crowded == ["N", "C", "U"]


def test_the_tolerance_bounds_the_distance_in_time(file: Path) -> None:
    text = OUTCOMES + "0.1,0,1,N\n"
    assert letters(replay(file, text, tolerance=0.02), [79.999], 1) == ["U"]
    assert letters(replay(file, text, tolerance=0.02), [80], 1) == ["N"]
    assert letters(replay(file, text, tolerance=0.02), [120], 1) == ["N"]
    assert letters(replay(file, text, tolerance=0.02), [120.001], 1) == ["U"]
    assert letters(replay(file, text, tolerance=0.0), [100], 1) == ["N"]


def test_outcomes_of_one_time_are_applied_in_the_order_of_the_file(file: Path) -> None:
    rows = "".join(f"0.1,0,1,{letter}\n" for letter in "NCBT")
    assert letters(replay(file, OUTCOMES + rows), [100, 100, 100, 100], 1) == list("NCBT")
    assert letters(replay(file, OUTCOMES + rows), [101, 102, 103, 104], 1) == list("NCBT")


@given(
    times=st.lists(st.integers(0, 30), min_size=1, max_size=12).map(sorted),
    used=st.lists(st.booleans(), min_size=12, max_size=12),
    now=st.integers(0, 30),
    tolerance=st.integers(0, 10),
)
def test_the_nearest_row_is_that_of_a_search_through_all(
    times: list[int], used: list[bool], now: int, tolerance: int
) -> None:
    ones = np.ones(len(times), np.int64)
    rows = LinkRows(np.array(times, np.int64), ones, 2 * ones)
    (found,) = rows.nearest(now, 1, np.array([2]), tolerance, used)
    free = [k for k, t in enumerate(times) if not used[k] and abs(t - now) <= tolerance]
    best = min(free, key=lambda k: (abs(times[k] - now), k), default=NO_ROW)
    assert found == best


def test_a_recorded_delay_replaces_airtime_and_latency(file: Path) -> None:
    text = "time,transmitter,receiver,outcome,delay\n0.1,0,1,R,0.004\n0.2,0,1,R,\n"
    run = replay(file, text, latency=0.003)
    letters(run, [100, 200], 1)
    airtime = int(run.transmissions["duration"][0])
    assert run.receptions["time"].tolist() == [104 * MS, 203 * MS + airtime + 33]


def test_what_is_known_beside_the_outcome_is_passed_on(file: Path) -> None:
    text = "time,transmitter,receiver,per,power_dbm,link\n0,0,1,0,-71.5,NLOSb\n"
    run = replay(file, text)
    letters(run, [0])
    known, unknown = run.receptions
    assert known["power_dbm"] == -71.5
    assert np.isnan(known["snir_db"])
    assert known["link"] == 2
    assert np.isnan(unknown["power_dbm"])
    assert unknown["link"] == 0


def test_a_relayed_packet_meets_the_recording_of_each_hop(file: Path) -> None:
    run = replay(file, RATES + "0,0,1,0\n0,1,2,0\n0,0,2,1\n")
    run.step(scene(row_of(3)), packets([packet(0, 0, to=2, via=(1,))]))
    assert outcomes(run.receptions) == {
        (0, 0, 1): "R",
        (0, 0, 2): "N",
        (0, 1, 0): "U",
        (0, 1, 2): "R",
    }


@pytest.mark.parametrize(
    "text", [RATES + "0,0,1,0.5\n", OUTCOMES + "".join(f"{k / 100},0,1,R\n" for k in range(30))]
)
def test_contract(file: Path, text: str) -> None:
    """Restoring a state also gives back the outcomes that were used since."""
    file.write_text(text)
    h = 10 * MS

    def inputs(t: int) -> dict[str, Any]:
        sent = [packet(t // h, 0, time=t + h // 2, to=0 if t % 3 else NO_VEHICLE)]
        return {**scene(row_of(3)), "packets": packets(sent if t % (3 * h) == 0 else [])}

    component = Trace(Trace.Parameters(file=file, tolerance=0.02))
    check_component(component, steps=12, h=h, inputs=inputs)


def test_a_wrong_file_is_refused_when_the_component_is_created(file: Path) -> None:
    with pytest.raises(ComponentTypeError, match=r"links.csv:2:7: `per`: `2` is no number between"):
        replay(file, RATES + "0,0,1,2\n")


def test_vehicles_that_are_named_by_text(file: Path, tmp_path: Path) -> None:
    names = tmp_path / "names.csv"
    names.write_text("name,id\nego,0\nv24,1\n")
    run = replay(file, RATES + "0,ego,v24,0\n0,ego,2,1\n", vehicles=names)
    assert letters(run, [0]) == ["RN"]


STOPS = st.lists(st.integers(0, 4), min_size=2, max_size=4, unique=True)


@given(st.data())
def test_the_replay_of_the_outcomes_of_a_run_is_that_run(
    tmp_path_factory: pytest.TempPathFactory, data: Any
) -> None:
    """Byte for byte: routes, several packets of one time, powers, receivers out of range."""
    sent = packets(
        packet(
            number, stops[0], time=data.draw(st.integers(0, 6)) * MS, to=stops[-1], via=stops[1:-1]
        )
        for number, stops in enumerate(data.draw(st.lists(STOPS, max_size=12)))
    )
    run = Run(ConstantPer(ConstantPer.Parameters(per=0.4, range=25.0, latency=0.0007)))
    receptions, transmissions = run.steps(scene(row_of(5)), sent, h=3 * MS, until=30 * MS)
    file = tmp_path_factory.mktemp("replay") / "links.csv"
    events = Events.joined(receptions, transmissions, start=0)
    write(outcome_columns(events, with_power=True), file, "a run")
    again = replay(file, tolerance=0.0, missing="error")
    again.steps(scene(row_of(5)), sent, h=5 * MS, until=30 * MS)
    assert again.receptions.tobytes() == receptions.tobytes()
    assert again.transmissions.tobytes() == transmissions.tobytes()


def test_error_rates_of_a_run_are_counted_per_link_and_bin() -> None:
    """Ten frames in each half second; by hand: what share of each was lost."""
    run = Run(ConstantPer(ConstantPer.Parameters(per=0.5, range=1000.0)))
    sent = packets(packet(k, k % 2, time=k * 25 * MS) for k in range(40))
    receptions, transmissions = run.steps(scene(row_of(3)), sent, h=100 * MS, until=1100 * MS)
    events = Events.joined(receptions, transmissions, start=0)
    found = error_rates(events, 500 * MS, with_power=True)
    expected: dict[tuple[float, int, int], list[bool]] = {}
    for r in receptions:
        start = 0.0 if r["packet"] * 25 < 500 else 0.5
        key = start, int(r["transmitter"]), int(r["receiver"])
        expected.setdefault(key, []).append(bool(r["outcome"]))
    keys = zip(map(float, found["time"]), found["transmitter"], found["receiver"], strict=True)
    assert dict(zip(keys, found["per"], strict=True)) == {
        key: pytest.approx(sum(lost) / 10) for key, lost in expected.items()
    }
    assert list(found["link"]) == ["LOS"] * 8
    power = receptions[(receptions["transmitter"] == 0) & (receptions["receiver"] == 1)][
        "power_dbm"
    ]
    assert found["power_dbm"][0] == pytest.approx(power[0], abs=0.005)


def test_rates_that_do_not_change_need_no_rows() -> None:
    run = Run(ConstantPer(ConstantPer.Parameters(per=1.0)))
    sent = packets(packet(k, 0, time=k * 25 * MS) for k in range(40))
    events = Events.joined(*run.steps(scene(row_of(3)), sent, h=100 * MS, until=1100 * MS), start=0)
    found = error_rates(events, 100 * MS, with_power=False)
    assert {name: list(map(float, cells)) for name, cells in found.items()} == {
        "time": [0.0, 0.0],
        "transmitter": [0.0, 0.0],
        "receiver": [1.0, 2.0],
        "per": [1.0, 1.0],
    }
