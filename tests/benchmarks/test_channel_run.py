"""The channel benchmark on a few vehicles, and what is computed from its measurements."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st

from benchmarks.benchmark import Measurement
from benchmarks.channel import ChannelBenchmark
from benchmarks.channel.benchmark import GROWTH
from benchmarks.channel.case import ChannelRun
from benchmarks.channel.exponent import between_ends, exponent_rows, fitted
from benchmarks.channel.workload import Workload, grid200
from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.timebase import nanoseconds

FEW = 5


@cache
def few_vehicles() -> Workload:
    layout = grid200().layout
    return Workload(
        name="few",
        layout=replace(
            layout,
            front=layout.front[:, :FEW],
            heading=layout.heading[:, :FEW],
            size=layout.size[:FEW],
        ),
        jitter=0.01,
        duration=nanoseconds("0.3"),
    )


def run(*, silent: bool = False, **parameters: object) -> Measurement:
    case = ChannelRun(
        workload=few_vehicles(),
        parameters={"model": "veins", **parameters},
        silent=silent,
    )
    return case.measure()


def test_every_packet_reaches_everybody_else() -> None:
    found = run(weak_receptions=True)
    assert found["packets"] == few_vehicles().sent >= 2 * FEW - 2
    assert found["receptions"] == found["packets"] * (FEW - 1)
    assert found["receptions"] == sum(found[letter] for letter in "RNCBTU")
    assert found["simulated_s"] == 0.3
    assert 0 < found["fmu_s"] + found["setup_s"] <= found["total_s"]


def test_weak_receptions_are_those_that_veins_does_not_count() -> None:
    with_weak, without = run(weak_receptions=True), run(weak_receptions=False)
    assert without["U"] == 0
    assert with_weak["U"] > 0
    assert without["receptions"] == with_weak["receptions"] - with_weak["U"]


def test_every_measurement_does_the_same_work() -> None:
    counted = ("packets", "receptions", *"RNCBTU")
    first, second = run(weak_receptions=True), run(weak_receptions=True)
    assert [first[name] for name in counted] == [second[name] for name in counted]


def test_nobody_hears_anything_when_nobody_sends() -> None:
    found = run(silent=True)
    assert found["packets"] == found["receptions"] == 0


def test_a_channel_that_refuses_is_named_with_the_time() -> None:
    still = few_vehicles()
    broken = replace(still, layout=replace(still.layout, front=still.layout.front.copy()))
    broken.layout.front[1, 2] = np.nan
    case = ChannelRun(workload=broken, parameters={})
    with pytest.raises(ComponentError, match=r"component `channel` at t = 0.2 s: .*position"):
        case.measure()


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(ComponentTypeError, match="there is no parameter `colour`"):
        run(colour=3)


def test_the_cases_are_those_of_veins_and_the_growing_grid() -> None:
    names = ChannelBenchmark().cases()
    assert len(names) == 2 * (4 * 2 + 2 + 1) + 2 * len(GROWTH)
    assert "grid200/veins/buildings+vehicles/noticed" in names
    assert "grid/1000/veins/buildings+vehicles/all" in names


def test_rows_are_compared_with_the_figures_of_veins() -> None:
    """Twice as fast is a ratio of two; silent runs and growing grids have no peer."""
    veins = {"cross44": 6.45, "grid200": 0.308}
    names = ChannelBenchmark().cases()
    measured = {name: [measurement(2 * veins.get(name.split("/")[0], 1.0))] * 2 for name in names}
    rows = {row.case: row for row in ChannelBenchmark().rows(measured)}
    for workload, speed in veins.items():
        for tail in ("veins/buildings+vehicles/noticed", "nlosim/buildings+vehicles/all"):
            row = rows[f"{workload}/{tail}"]
            assert row.peer == pytest.approx(speed)
            assert row.ratio == pytest.approx(2.0)
        assert rows[f"{workload}/veins/buildings+vehicles/silent"].ratio is None
        assert rows[f"{workload}/veins/free/all"].peer != row.peer
    assert rows["grid/50/veins/buildings+vehicles/all"].ratio is None
    assert rows["growth/all/total/fit"].ours == pytest.approx(0.0)
    details = rows["cross44/veins/free/all"].details
    assert details["cpu_ns_per_delivery"] == pytest.approx(1e9 * details["cpu_s"] / (10 * 4))


def measurement(speed: float) -> Measurement:
    counts = dict.fromkeys("RNCBTU", 1)
    return {
        "total_s": 1 / speed,
        "setup_s": 0.1 / speed,
        "fmu_s": 0.5 / speed,
        "wall_s": 2 / speed,
        "simulated_s": 1.0,
        "vehicles": 5,
        "packets": 10,
        "receptions": 6,
        **counts,
    }


def test_the_parts_of_the_time_add_up() -> None:
    names = ChannelBenchmark().cases()
    measured = {name: [measurement(1.0 + k)] for k, name in enumerate(names)}
    rows = ChannelBenchmark().rows(measured)
    for workload in ("cross44", "grid200"):
        parts = [row for row in rows if row.case.startswith(f"split/{workload}/")]
        (full,) = measured[f"{workload}/veins/buildings+vehicles/all"]
        assert len(parts) == 6
        assert sum(row.ours for row in parts) == pytest.approx(full["total_s"])
        assert sum(row.details["share_percent"] for row in parts) == pytest.approx(100)


def test_exponents_are_left_out_unless_the_whole_grid_was_measured() -> None:
    measured = {f"grid/{n}/veins/buildings+vehicles/all": [measurement(1.0)] for n in GROWTH[1:]}
    assert [row.case for row in ChannelBenchmark().rows(measured)] == list(measured)


@given(scale=st.floats(1e-3, 1e3), power=st.floats(-3, 3))
def test_a_power_law_has_its_exponent(scale: float, power: float) -> None:
    cost = {n: scale * n**power for n in GROWTH}
    assert fitted(cost) == pytest.approx(power, abs=1e-9)
    assert between_ends(cost) == pytest.approx(power, abs=1e-9)


def test_the_set_up_does_not_soften_the_growth() -> None:
    """The cost per vehicle grows by one power less; a smaller exponent is better."""
    runs = {
        n: [{"total_s": 7.0 + n**1.5, "setup_s": 7.0}, {"total_s": 1 + n**1.7, "setup_s": 1.0}]
        for n in GROWTH
    }
    rows = {row.case: row for row in exponent_rows("growth", runs)}
    for how in ("fit", "ends"):
        total, each = rows[f"growth/total/{how}"], rows[f"growth/per vehicle/{how}"]
        assert (total.low, total.ours, total.high) == pytest.approx((1.5, 1.6, 1.7))
        assert (each.low, each.ours, each.high) == pytest.approx((0.5, 0.6, 0.7))
        assert total.ratio == pytest.approx(1.3 / 1.6)
        assert each.ratio == pytest.approx(1.3 / 0.6)
