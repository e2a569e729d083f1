"""All measures of whole runs: of the red light, of a town nobody wrote for us, of random events."""

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import LINKS, OUTCOMES, RECEPTION, unframe
from orchestrator.cli import main
from orchestrator.measure import Answer, Measure, installed, measure_type
from orchestrator.recording.reader import Recording
from studies.measures.awareness import NeighbourAwareness
from studies.measures.prr import PacketReceptionRatio
from tests.studies.measures.world import Body, packet, reception, record, transmission

ROOT = Path(__file__).parents[3]
OF_ANY_SYSTEM = {"energy", "signal", "signals"}  # they want to be told of what, or say it of all
OF_AN_ENCOUNTER = {"decision"}  # somebody hidden, and somebody who sees him
NAMES = sorted(
    name
    for name, origin in installed().items()
    if "studies.measures" in origin and name not in OF_ANY_SYSTEM | OF_AN_ENCOUNTER
)
ASKED = "measures={" + ", ".join(f"{name}: " for name in NAMES) + "}"


@pytest.fixture(scope="module")
def red_light(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("red") / "run"
    scenario = str(ROOT / "scenarios" / "red_light.yaml")
    arguments = ["run", scenario, "--set", "time.stop=3 s", "--set", ASKED, "--quiet"]
    assert main([*arguments, "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("town")
    scene = str(ROOT / "docs" / "examples" / "town" / "town.sumocfg")
    assert main(["scene", "new", scene, "--out", str(folder / "town.yaml")]) == 0
    arguments = ["run", str(folder / "town.yaml"), "--set", "time.stop=15 s", "--set", ASKED]
    assert main([*arguments, "--out", str(folder / "run"), "--quiet"]) == 0
    return folder / "run"


def test_there_are_measures() -> None:
    assert NAMES == ["aoi", "awareness", "cbr", "delivery", "hidden", "pet", "pir", "prr", "ttc"]


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["red_light", "town"])
def test_every_measure_finds_plausible_numbers(
    scenario: str, request: pytest.FixtureRequest
) -> None:
    out: Path = request.getfixturevalue(scenario)
    found = json.loads((out / "metrics.json").read_text())["measures"]
    assert sorted(found) == NAMES
    values = [value for each in found.values() for value in each.values()]
    assert all(not isinstance(v, float) or (math.isfinite(v) and v >= 0) for v in values)
    assert found["prr"]["unplaced"] == 0
    assert found["prr"]["weak_recorded"] is True
    assert 0 < found["prr"]["prr"] <= 1
    assert found["prr"]["prr_LOS"] >= found["prr"]["prr"] - 1e-12
    assert 100 <= found["pir"]["pir_median_ms"] < 102  # BSMs ten times a second
    assert 0 < found["cbr"]["cbr_mean"] < found["cbr"]["cbr_max"] < 1
    assert 0.3 < found["delivery"]["bsm_latency_median_ms"] < 5  # 0.368 ms on the air
    assert 45 < found["aoi"]["aoi_median_ms"] < 100
    assert found["prr"]["prr"] < found["awareness"]["nar"] <= 1
    assert found["ttc"]["vehicles"] > 5
    assert found["pet"]["too_fast"] == 0
    assert b"<svg" in (out / "measures.svg").read_bytes()
    tables = {path.stem.partition("-")[0] for path in (out / "measures").glob("*.csv")}
    assert tables == set(NAMES) - {"delivery"}


def test_the_ratio_over_distance_is_what_a_slow_count_finds(red_light: Path) -> None:
    """One reception after the other, where each vehicle was when the channel told it."""
    run = Recording(red_light)
    ids, place = run["traffic.vehicle.id"], run["traffic.vehicle.position"]
    told = run["channel.receptions"]
    tried: Counter[tuple[str, float]] = Counter()
    heard: Counter[tuple[str, float]] = Counter()
    for k, time in enumerate(told.times.tolist()):
        where = dict(zip(np.asarray(ids.at(time)).tolist(), place.at(time), strict=True))
        for event in unframe("RCPT", bytes(told[k]), RECEPTION):
            a, b = where[int(event["transmitter"])], where[int(event["receiver"])]
            cell = LINKS[event["link"]], math.hypot(*(a - b)[:2]) // 50
            tried[cell] += 1
            heard[cell] += OUTCOMES[event["outcome"]] == "R"
    edges = tuple(50.0 * k for k in range(9))
    table = PacketReceptionRatio(edges=edges).compute(run).tables["distance"]
    assert sum(tried.values()) > 100_000
    for link, low, receivers, received in zip(
        table["link"], table["from_m"], table["receivers"], table["received"], strict=True
    ):
        names = LINKS if link == "all" else (link,)
        assert receivers == sum(tried[name, low // 50] for name in names)
        assert received == sum(heard[name, low // 50] for name in names)


def test_the_ratio_does_not_depend_on_what_the_channel_tells(tmp_path: Path) -> None:
    """With and without records of frames that nobody noticed; link classes do, and it is said."""
    found = []
    for weak in ("true", "false"):
        out = tmp_path / weak
        scenario = str(ROOT / "scenarios" / "red_light.yaml")
        arguments = ["run", scenario, "--set", "time.stop=1 s", "--set", "measures={prr: }"]
        chosen = ["--set", f"components.channel.parameters.weak_receptions={weak}"]
        assert main([*arguments, *chosen, "--no-figure", "--out", str(out), "--quiet"]) == 0
        found.append(json.loads((out / "metrics.json").read_text())["measures"]["prr"])
    every, noticed = found
    assert (every["weak_recorded"], noticed["weak_recorded"]) == (True, False)
    assert every["prr"] == pytest.approx(noticed["prr"], rel=1e-4)  # frames in flight at the end
    assert noticed["prr_NLOSb"] > 10 * every["prr_NLOSb"]


def _random_run(folder: Path, *, backwards: bool) -> Recording:
    rng = np.random.default_rng(5)
    bodies = [
        Body(
            id=int(number),
            start=tuple(rng.uniform(-60, 60, 2)),
            velocity=tuple(rng.uniform(-12, 12, 2)),
            equipped=bool(rng.random() < 0.8),
            since=float(rng.choice([0.0, 1.0])),
        )
        for number in rng.permutation(40)[:12]
    ]
    radios = [body.id for body in bodies if body.equipped and body.since == 0.0]
    packets, receptions, sent = [], [], []
    for k in range(200):
        source, time = int(rng.choice(radios)), 0.02 * k + 0.001
        packets.append(packet(k, source, time))
        sent.append(transmission(k, source, time))
        receptions += [
            reception(
                k,
                (source, other),
                time + 0.0004,
                str(rng.choice(list("RRNU"))),
                link=rng.choice(LINKS),
            )
            for other in radios
            if other != source
        ]
    return record(
        folder,
        bodies,
        4.5,
        packets=packets,
        receptions=receptions,
        transmissions=sent,
        backwards=backwards,
    )


def spelt(answer: Answer) -> Any:
    tables = {
        name: {column: np.asarray(values).tolist() for column, values in table.items()}
        for name, table in answer.tables.items()
    }
    return json.dumps({"numbers": dict(answer.numbers), "tables": tables})


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name != "cbr"])
def test_the_order_of_vehicles_changes_nothing(name: str, tmp_path: Path) -> None:
    """The busy ratio apart: it has the order of the channel, which asks for ascending ids."""
    measure: Measure = measure_type(name)()
    first = measure.compute(_random_run(tmp_path / "a", backwards=False))
    second = measure.compute(_random_run(tmp_path / "b", backwards=True))
    assert isinstance(first, Answer)
    assert isinstance(second, Answer)
    assert spelt(first) == spelt(second)
    assert first.numbers


def test_everybody_is_aware_of_everybody_where_nothing_is_lost(tmp_path: Path) -> None:
    bodies = [Body(id=k, start=(10.0 * k, 0.0)) for k in range(3)]
    packets = [packet(10 * k + a, a, 0.1 * k) for k in range(40) for a in range(3)]
    heard = [
        reception(10 * k + a, (a, b), 0.1 * k + 0.001)
        for k in range(40)
        for a in range(3)
        for b in range(3)
        if a != b
    ]
    run = record(tmp_path, bodies, 4.0, packets=packets, receptions=heard)
    assert NeighbourAwareness().compute(run).numbers["nar"] == 1.0
