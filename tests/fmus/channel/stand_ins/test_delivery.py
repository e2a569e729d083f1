"""What link models share: when frames are sent, heard and passed on, whoever decides."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from typing_extensions import override

from fmus.channel.interface import INTERFACE
from fmus.channel.stand_ins import (
    ConstantPer,
    LinkModel,
    LinkModelComponent,
    RadioParameters,
    Trace,
    Verdicts,
)
from fmus.channel.stand_ins.connectors import CONNECTORS
from fmus.messages.connectors import SIGNALS
from fmus.messages.records import BSM, FATES, NO_VEHICLE, NOISE, OUTCOMES, RECEPTION, frame
from orchestrator.parameters import PythonComponentType
from orchestrator.signal import Causality
from tests.fmus.channel.harness import MS, packet, packets
from tests.fmus.channel.stand_ins.harness import SENT, Run, by_time, outcomes, row_of, scene

AIRTIME = 32_000 + 8_000 + 8_000 * 41  # 238 bytes at 6 Mbit/s: ceil((16 + 1904 + 6) / 48) symbols
FLIGHT = 33  # over 10 m [ns]


def run_of(**parameters: Any) -> Run:
    return Run(ConstantPer(ConstantPer.Parameters(**parameters)))


def perfect(**parameters: Any) -> Run:
    return run_of(per=0.0, **parameters)


def test_the_connectors_are_those_of_the_channel_without_its_probes() -> None:
    """By name and causality; fmus.messages.connectors has the types, which are tested there."""
    wanted = {
        v.name: Causality(v.causality)
        for v in INTERFACE.variables
        if v.causality in {"input", "output"} and not v.name.startswith("probe.")
    }
    assert {name: connector.causality for name, connector in CONNECTORS.items()} == wanted
    assert set(wanted) <= set(SIGNALS)
    for name, connector in CONNECTORS.items():
        assert (connector.kind(), connector.unit) == (SIGNALS[name].kind(), SIGNALS[name].unit)


@pytest.mark.parametrize("kind", [ConstantPer, Trace])
def test_parameters_that_the_channel_has_too_are_the_same(
    kind: type[ConstantPer] | type[Trace],
) -> None:
    ours = PythonComponentType(kind).parameters
    theirs = {v.name: v for v in INTERFACE.variables if v.causality == "parameter"}
    common = set(ours) & set(theirs)
    assert common >= {"bitrate", "mac_header", "relay_delay", "busy_window", "weak_receptions"}
    for name in common - {"seed"}:  # drawn if it is not given, there as here
        assert ours[name].default == theirs[name].start, name
        assert ours[name].unit == theirs[name].unit, name


@pytest.mark.parametrize(
    ("bitrate", "symbols"),
    [(3e6, 81), (4.5e6, 54), (6e6, 41), (9e6, 27), (12e6, 21), (18e6, 14), (24e6, 11), (27e6, 9)],
)
def test_a_reception_ends_after_airtime_and_flight(bitrate: float, symbols: int) -> None:
    """1926 bits with SERVICE and tail, in symbols of 24 to 216 bits and 8 us."""
    run = perfect(bitrate=bitrate)
    (heard,) = run.step(scene(row_of(2)), packets([packet(0, 0, time=MS)]))
    assert heard["time"] == MS + 40_000 + 8_000 * symbols + FLIGHT
    assert run.transmissions["duration"].tolist() == [40_000 + 8_000 * symbols]


def test_a_given_duration_and_the_latency_count() -> None:
    run = perfect(latency=0.002)
    (heard,) = run.step(scene(row_of(2)), packets([packet(0, 0, duration=1_000_000)]))
    assert heard["time"] == 1_000_000 + FLIGHT + 2_000_000


def test_a_reception_is_told_in_the_step_in_which_the_frame_ends() -> None:
    run = perfect()
    pair, sent = scene(row_of(2)), packets([packet(0, 0, time=900_000)])
    assert len(run.step(pair, sent, h=MS)) == 0  # 900 to 1268 us
    assert run.transmissions["time"].tolist() == [900_000]
    assert run.step(pair, h=MS)["time"].tolist() == [900_000 + AIRTIME + FLIGHT]
    assert len(run.step(pair, h=MS)) == 0


def test_a_packet_ahead_of_its_time_waits_and_a_late_one_is_sent_at_once() -> None:
    run = perfect()
    pair = scene(row_of(2))
    run.step(pair, packets([packet(0, 0, time=25 * MS)]))
    assert len(run.transmissions) == 0
    run.step(pair, packets([packet(1, 0, time=3 * MS)]))
    assert run.transmissions["time"].tolist() == [10 * MS]
    run.step(pair)
    assert run.transmissions[["packet", "time"]].tolist() == [(1, 10 * MS), (0, 25 * MS)]


def test_a_packet_that_is_held_in_the_input_is_sent_once() -> None:
    run = perfect()
    held = packets([packet(0, 0), packet(1, 1, time=15 * MS)])
    for _ in range(4):
        run.step(scene(row_of(2)), held)
    run.step(scene(row_of(2)), packets([packet(1, 1), packet(2, 0)]))
    assert sorted(run.transmissions["packet"].tolist()) == [0, 1, 2]


def test_a_relay_stores_and_forwards() -> None:
    run = perfect(relay_delay=0.001)
    run.step(scene(row_of(4)), packets([packet(0, 0, to=3, via=(1, 2))]))
    sent = run.transmissions
    assert sent["transmitter"].tolist() == [0, 1, 2]
    assert sent["hop"].tolist() == [0, 1, 2]
    assert (np.diff(sent["time"]) == AIRTIME + FLIGHT + MS).all()
    assert (sent["queued"] == sent["time"]).all()
    addressed = run.receptions[run.receptions["addressed"] == 1]
    assert addressed[["transmitter", "receiver"]].tolist() == [(0, 1), (1, 2), (2, 3)]
    assert len(run.receptions) == 9  # and overheard by everybody else


def test_a_relay_that_did_not_receive_does_not_forward() -> None:
    run = run_of(per=1.0)
    run.step(scene(row_of(3)), packets([packet(0, 0, to=2, via=(1,))]))
    assert run.transmissions["hop"].tolist() == [0]


def test_the_range_of_a_hop_is_its_own() -> None:
    """The relay reaches who is out of the source's range, over several steps."""
    run = perfect(range=12.0)
    run.steps(scene(row_of(3)), packets([packet(0, 0, to=2, via=(1,))]), h=MS // 10, until=2 * MS)
    assert outcomes(run.receptions) == {
        (0, 0, 1): "R",
        (0, 0, 2): "U",
        (0, 1, 0): "R",
        (0, 1, 2): "R",
    }


def test_radios_that_notice_nothing_need_not_be_reported() -> None:
    run = perfect(range=12.0, weak_receptions=False)
    run.step(scene(row_of(3)), packets([packet(0, 0)]))
    assert outcomes(run.receptions) == {(0, 0, 1): "R"}


def test_vehicles_without_a_radio_hear_nothing() -> None:
    run = perfect()
    run.step(scene(row_of(4), equipped=[0, 2]), packets([packet(0, 0)]))
    assert outcomes(run.receptions) == {(0, 0, 2): "R"}


def test_what_a_vehicle_that_has_left_was_to_send_is_gone() -> None:
    run = perfect()
    everyone, without = scene(row_of(3)), scene({0: (0, 0), 2: (20, 0)})
    run.step(
        everyone,
        packets([packet(0, 1, time=15 * MS), packet(1, 0, to=2, via=(1,), time=9_900_000)]),
    )
    run.step(without)
    gone = run.transmissions[run.transmissions["fate"] == FATES.index("gone")]
    assert gone[["packet", "hop", "duration"]].tolist() == [(1, 1, 0), (0, 0, 0)]
    assert (run.transmissions["fate"] == SENT).sum() == 1
    # vehicle 1 heard hop 0 before it left: positions count when a frame starts
    assert outcomes(run.receptions) == {(1, 0, 1): "R", (1, 0, 2): "R"}


def test_noise_is_sent_and_heard_by_nobody() -> None:
    run = perfect()
    run.step(scene(row_of(3)), packets([packet(0, 0, kind=NOISE, duration=MS)]))
    assert len(run.receptions) == 0
    assert run.transmissions["kind"].tolist() == [NOISE]


@given(st.data())
def test_outcomes_depend_neither_on_the_steps_nor_on_who_else_is_there(data: Any) -> None:
    count = data.draw(st.integers(1, 12))
    vehicle = st.integers(0, 4)
    sent = [
        packet(
            number,
            route[0],
            time=data.draw(st.integers(0, 8 * MS)),
            to=data.draw(st.sampled_from([NO_VEHICLE, route[-1]])),
            via=route[1:-1],
            size=data.draw(st.integers(1, 1400)),
        )
        for number in range(count)
        for route in [data.draw(st.lists(vehicle, min_size=2, max_size=4, unique=True))]
    ]
    cuts = data.draw(st.sampled_from([1, 3, 10, 97]))
    whole = run_of(per=0.3).steps(scene(row_of(5)), packets(sent), h=97 * MS, until=97 * MS)
    cut = run_of(per=0.3).steps(scene(row_of(5)), packets(sent), h=97 * MS // cuts, until=97 * MS)
    more, _ = run_of(per=0.3).steps(scene(row_of(9)), packets(sent), h=97 * MS, until=97 * MS)
    for first, second in zip(whole, cut, strict=True):
        assert first.tobytes() == second.tobytes()
    known = more[more["receiver"] < 5]
    assert known.tobytes() == whole[0].tobytes()
    np.testing.assert_array_equal(by_time(whole[0]), np.arange(len(whole[0])))


def test_the_busy_ratio_is_the_share_of_the_last_window_with_a_frame_on_the_air() -> None:
    """Frames of 1 ms at 0, 0.5 and 9.5 ms: 1.5 and 0.5 ms of the first window, then 0.5 ms."""
    run = perfect(busy_window=0.01, range=15.0)
    frames = [packet(k, 0, time=t, duration=MS) for k, t in enumerate((0, MS // 2, 19 * MS // 2))]
    world = scene({**row_of(3), 7: (500.0, 0.0)})
    run.step(world, packets(frames), h=5 * MS)
    assert run.busy_ratio().tolist() == [0, 0, 0, 0]
    run.step(world, h=5 * MS)
    # vehicle 0 sends, 1 hears, 2 and 7 are out of range
    np.testing.assert_allclose(run.busy_ratio(), [0.2, 0.2, 0, 0])
    run.step(world, h=10 * MS)
    np.testing.assert_allclose(run.busy_ratio(), [0.05, 0.05, 0, 0])
    run.step(scene(row_of(2)), h=30 * MS)
    np.testing.assert_array_equal(run.busy_ratio(), [0, 0])


@given(st.lists(st.tuples(st.integers(0, 99), st.integers(1, 60)), max_size=12))
def test_overlapping_frames_busy_the_medium_once(frames: list[tuple[int, int]]) -> None:
    run = perfect(busy_window=0.001)
    sent = [
        packet(k, 0, time=10_000 * start, duration=10_000 * length)
        for k, (start, length) in enumerate(frames)
    ]
    run.step(scene(row_of(2)), packets(sent), h=MS)
    busy = {tick for start, length in frames for tick in range(start, min(start + length, 100))}
    np.testing.assert_allclose(run.busy_ratio(), len(busy) / 100)


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        ([packet(0, 9)], r"packets\[0\].source: there is no vehicle 9"),
        ([packet(0, -1)], r"packets\[0\].source: there is no vehicle -1"),
        ([packet(0, 0), packet(1, 2)], r"packets\[1\].source: vehicle 2 is not equipped"),
        ([packet(0, 0, to=0)], r"packets\[0\]: a vehicle stands twice on the way \[0, 0\]"),
        ([packet(0, 0, to=1, via=(1,))], r"a vehicle stands twice on the way \[0, 1, 1\]"),
        ([packet(0, 0, via=(NO_VEHICLE, 1))], r"\[0, -1, 1, -1\] is no way from a source"),
        ([packet(0, 0, to=-5)], r"\[0, -5\] is no way from a source"),
        (
            [packet(0, 0, size=4060)],
            r"4060 bytes and 38 of headers do not fit .* 4095 bytes; split",
        ),
        ([packet(0, 0, duration=-1)], r"packets\[0\].duration: -1 ns is not within"),
        ([packet(0, 0, duration=2**31)], r"packets\[0\].duration: 2147483648 ns is not within"),
        (
            [packet(0, 0, category=4)],
            r"packets\[0\].access_category is 4; it must be 0 to 3",
        ),
        ([packet(0, 0, power_offset=np.nan)], r"packets\[0\].power_offset is nan dB"),
        ([packet(3, 0), packet(3, 1)], r"packets: id 3 appears twice; ids are unique in a run"),
    ],
)
def test_a_malformed_packet_is_refused(sent: list[Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        perfect().step(scene(row_of(3), equipped=[0, 1]), packets(sent))


def test_what_is_no_frame_of_packets_is_refused() -> None:
    with pytest.raises(ValueError, match="not a `PKTS` frame"):
        perfect().step(scene(row_of(2)), frame("RCPT", np.zeros(1, RECEPTION)))


def test_nothing_is_sent_in_an_empty_scene() -> None:
    run = perfect()
    run.step(scene({}))
    assert run.busy_ratio().shape == (0,)


def test_every_kind_of_packet_keeps_its_kind_and_category() -> None:
    run = perfect()
    run.step(scene(row_of(2)), packets([packet(0, 0, kind=BSM + 2, category=1)]))
    assert run.receptions["kind"].tolist() == [BSM + 2]
    assert run.transmissions[["kind", "access_category"]].tolist() == [(BSM + 2, 1)]
    assert OUTCOMES[run.receptions["outcome"][0]] == "R"


class Careless(LinkModelComponent):
    """A channel of somebody else's, whose model returns what it is not asked for."""

    def __init__(self, parameters: RadioParameters, verdicts: Any = None) -> None:
        super().__init__(parameters)
        self._verdicts = verdicts

    @override
    def link_model(self, seed: int) -> LinkModel:
        return CarelessLinks(self._verdicts)


class CarelessLinks(LinkModel):
    def __init__(self, verdicts: Any) -> None:
        self._verdicts = verdicts

    @override
    def judge(self, frame: Any, receivers: Any, usual_delay: Any) -> Verdicts:
        return self._verdicts  # type: ignore[no-any-return]


def test_a_probability_is_no_verdict() -> None:
    """All that are not 0 would be received."""
    with pytest.raises(TypeError, match="`received` is float64, not bool; compare a probability"):
        Verdicts.of(np.array([0.5]), np.array([0]))


@pytest.mark.parametrize(
    ("verdicts", "error", "complaint"),
    [
        (np.ones(1), TypeError, "`CarelessLinks.judge` returned `ndarray`, not `Verdicts`"),
        (
            Verdicts.of(np.ones(3, bool), np.ones(3, np.int64)),
            ValueError,
            r"`CarelessLinks.judge` judged \(3,\) of 1 receivers: one verdict for each",
        ),
        (
            Verdicts.of(np.ones(1, bool), np.array([-1])),
            ValueError,
            "every `delay` is a whole number of nanoseconds, not negative",
        ),
        (
            Verdicts.of(np.ones(1, bool), np.array([np.nan])),
            ValueError,
            "every `delay` is a whole number of nanoseconds, no float64",
        ),
        (
            replace(Verdicts.of(np.ones(1, bool), np.array([0])), outcome=np.array([77], np.uint8)),
            ValueError,
            f"every `outcome` is an index into `OUTCOMES`, 0 .. {len(OUTCOMES) - 1}$",
        ),
    ],
)
def test_a_model_that_gives_no_verdicts_is_told_so(
    verdicts: Any, error: type[Exception], complaint: str
) -> None:
    run = Run(Careless(Careless.Parameters(), verdicts))
    with pytest.raises(error, match=complaint):
        run.step(scene(row_of(2)), packets([packet(0, 0, time=MS)]))


def test_a_channel_without_parameters_of_its_own_has_those_of_the_radios() -> None:
    assert set(PythonComponentType(Careless).parameters) < set(
        PythonComponentType(ConstantPer).parameters
    )
