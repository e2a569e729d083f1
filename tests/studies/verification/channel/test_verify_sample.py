"""The channel agrees with the golden sample, and what does not agree is found."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.parameters import ComponentType, Parameter
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.verification import (
    GoldenSet,
    Verification,
    as_text,
    read_golden_set,
    verify,
)

from .golden_sample import GOLDEN, RUN, SEEDS, add, change_cell, change_json, find_row

Change = Callable[[Path], None]


def of_json(name: str, change: Callable[[Any], object]) -> Change:
    return lambda folder: change_json(folder / name, change)


def of_cell(name: str, column: str, change: Callable[[str], str], row: int = 0) -> Change:
    return lambda folder: change_cell(folder / name, column, change, row)


def outcome(before: str, after: str) -> Change:
    """The first event with one outcome gets another."""

    def change(folder: Path) -> None:
        path = folder / RUN / "rx_events.csv.gz"
        change_cell(path, "outcome", lambda _: after, find_row(path, "outcome", before))

    return change


def first_loss(scenes: Any) -> None:
    scenes[0]["queries"][0]["loss_db"] += 2e-6


def first(key: str, amount: float) -> Callable[[Any], None]:
    def change(cases: Any) -> None:
        cases[0][key] += amount

    return change


@pytest.fixture(scope="module")
def sample(channel: ChannelUnderTest) -> Verification:
    return verify(channel, read_golden_set(GOLDEN, SEEDS))


def test_every_file_of_the_sample_passes(sample: Verification) -> None:
    assert as_text(sample).splitlines()[-1] == "9 of 9 files pass"
    assert {name for name in sample.files if name.startswith("stack/")} == {RUN}
    assert sample.files["building_shadowing.json"].excepted == 8
    assert sample.files[RUN].cases == 3784


def test_the_data_have_the_documented_fields(sample: Verification) -> None:
    data = json.loads(json.dumps(sample.as_data(), allow_nan=False))
    assert data["pass"] is True
    assert data["skipped"] == {"README.md": "describes the files"}
    for file in data["files"].values():
        assert file["pass"] is True
        assert file["cases"] > 0
        assert file["mismatches"] == 0
        assert 0 <= file["max_error"] <= file["tolerance"]
    assert data["files"][RUN]["outcomes"]["golden"] == {
        "R": 1981, "N": 106, "C": 45, "B": 82, "T": 0, "U": 1570,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "name", "note"),
    [
        (of_cell("pathloss.csv", "loss_db", add(2e-6)), "pathloss.csv", "pathloss.csv:2: golden"),
        (
            of_json("building_shadowing.json", first_loss),
            "building_shadowing.json",
            "building_shadowing.json: [0].queries[0] (id 0): golden",
        ),
        (
            of_json("vehicle_shadowing.json", first_loss),
            "vehicle_shadowing.json",
            "vehicle_shadowing.json: [0].queries[0] (id 0): golden",
        ),
        (
            of_json("knife_edge_profile.json", first("loss_db", 2e-6)),
            "knife_edge_profile.json",
            "knife_edge_profile.json: [0] (id 0)",
        ),
        (
            of_json("antenna_gain.json", first("gain_db", 2e-6)),
            "antenna_gain.json",
            "antenna_gain.json: [0] (id 0)",
        ),
        (
            of_json("min_sinr.json", first("min_sinr_db", 2e-6)),
            "min_sinr.json",
            "min_sinr.json: [0] (id 0)",
        ),
        (
            of_cell("nist_error_rate.csv", "header_success", add(2e-9), row=5),
            "nist_error_rate.csv",
            "nist_error_rate.csv:7: header_success",
        ),
        (
            of_cell("nakagami_stats.csv", "mean_factor", add(0.01), row=1),
            "nakagami_stats.csv",
            "nakagami_stats.csv:3: mean_factor",
        ),
        (
            of_cell("nakagami_stats.csv", "q25", add(0.01), row=2),
            "nakagami_stats.csv",
            "nakagami_stats.csv:4: q25",
        ),
        (
            of_cell(f"{RUN}/rx_events.csv.gz", "rx_dbm", add(0.0012)),
            RUN,
            f"{RUN}: v24, seq 0, to v30, at 0.100605000 s: received power",
        ),
        (
            of_cell(f"{RUN}/rx_events.csv.gz", "min_sinr_db", add(0.0012)),
            RUN,
            f"{RUN}: v24, seq 0, to v30, at 0.100605000 s: lowest SNIR",
        ),
        (outcome("U", "N"), RUN, "golden N"),
        (outcome("B", "C"), RUN, "golden C"),
        (outcome("R", "T"), RUN, "golden T"),
        (
            of_cell(f"{RUN}/tx.csv.gz", "duration_us", add(8)),
            RUN,
            f"{RUN}: frame 0 of v24 goes on air at 100605000 ns for 312000 ns, golden at 10060",
        ),
        (
            of_cell(f"{RUN}/pairs.csv", "lost_rx_locked_on_other", lambda cell: str(int(cell) + 1)),
            RUN,
            f"{RUN}/pairs.csv: v0 to v38: golden 1 of class B, ours 0",
        ),
        (
            of_json(f"{RUN}/run.json", lambda run: run["outcome_totals"].update(B=130)),
            RUN,
            f"{RUN}: own medium access: golden 130 of outcome B",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_one_changed_value_is_found_and_named(
    channel: ChannelUnderTest, golden: Path, change: Change, name: str, note: str
) -> None:
    for path in golden.iterdir():  # the file in question is enough
        if path.name not in {name, "stack"} and path.is_file():
            path.unlink()
    change(golden)
    verification = verify(channel, read_golden_set(golden, SEEDS))
    comparison = verification.files[name]
    assert comparison.misses + comparison.mismatches == 1
    assert note in comparison.notes[0]
    assert not verification.passes
    assert note in as_text(verification)


@pytest.mark.slow
@pytest.mark.parametrize("is_missing", [True, False])
def test_events_that_one_side_lacks_are_mismatches(
    channel: ChannelUnderTest, golden: Path, *, is_missing: bool
) -> None:
    """A golden event less is one of ours too many; one at a vehicle out of range has no partner."""
    path = golden / RUN / "rx_events.csv.gz"
    if is_missing:
        change_cell(path, "rx", lambda _: "v24")  # of a vehicle's own frame
    else:
        change_json(
            golden / RUN / "run.json", lambda run: run.update(max_interference_distance_m=1)
        )
    comparison = verify(channel, read_golden_set(golden, SEEDS)).files[RUN]
    if is_missing:
        assert any("v24, seq 0, to v24" in note and "no event of ours" in note
                   for note in comparison.notes)  # fmt: skip
        assert any("v24, seq 0, to v30" in note and "no golden event, ours R" in note
                   for note in comparison.notes)  # fmt: skip
        assert comparison.mismatches == 2
    else:
        assert comparison.mismatches >= 3784


class Spoilt(ComponentType):
    """The channel, but some parameters have other values than those asked for."""

    def __init__(self, channel_type: ComponentType, wrong: Mapping[str, Any]) -> None:
        self._type = channel_type
        self._wrong = wrong

    @property
    @override
    def description(self) -> str:
        return self._type.description

    @property
    @override
    def parameters(self) -> Mapping[str, Parameter]:
        return self._type.parameters

    @override
    def create(self, name: str, values: Mapping[str, Any]) -> Component:
        return self._type.create(name, {**values, **self._wrong})


@pytest.mark.parametrize(
    ("wrong", "files"),
    [
        ({"model": "nlosim"}, ["vehicle_shadowing.json", "knife_edge_profile.json", RUN]),
        ({"path_loss_exponent": 2.0001}, ["pathloss.csv"]),
        ({"permittivity": 1.0201}, ["pathloss.csv", RUN]),
        ({"wall_loss": 9.01}, ["building_shadowing.json", RUN]),
        ({"sensitivity": -93.0}, [RUN]),
        ({"noise_floor": -97.99}, ["nist_error_rate.csv", "min_sinr.json", RUN]),
        ({"bitrate": 9e6}, ["nist_error_rate.csv", RUN]),
        ({"fading_clipped": False, "model": "nlosim"}, ["nakagami_stats.csv"]),
        ({"transmit_power": 25.0}, ["nist_error_rate.csv", "min_sinr.json", RUN]),
    ],
    ids=str,
)
def test_a_wrong_channel_does_not_pass(
    channel_type: ComponentType, wrong: Mapping[str, Any], files: list[str]
) -> None:
    checks = read_golden_set(GOLDEN, SEEDS).checks
    concerned = GoldenSet({name: checks[name] for name in files}, {})
    found = verify(ChannelUnderTest(Spoilt(channel_type, wrong)), concerned)
    assert not any(comparison.passes for comparison in found.files.values())


def test_a_file_on_which_the_channel_fails_does_not_keep_the_others_from_passing(
    channel: ChannelUnderTest, golden: Path
) -> None:
    change_cell(golden / "pathloss.csv", "tx_x", lambda _: "1e300")
    (golden / "nakagami_stats.csv").unlink()  # takes long
    found = verify(channel, read_golden_set(golden, SEEDS))
    failed = found.files["pathloss.csv"]
    assert "component `channel`" in failed.notes[0]
    assert found.as_data()["files"]["pathloss.csv"]["max_error"] is None
    assert {name for name, one in found.files.items() if not one.passes} == {"pathloss.csv"}
