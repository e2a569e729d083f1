"""A campaign that never ran, with outcomes that we choose."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.scenario.document import Document
from studies.collision.conditions import Condition
from studies.collision.runs import (
    CONSTANT_PER,
    LOAD,
    METRICS,
    POLICIES,
    RADIO,
    RELAY,
    Point,
    Run,
)
from tests.studies.results import Levels

POLICY_LEVELS = ("expert", "blind", "early-fusion", "cooperative-16", "cooperative-32")
PERS = tuple(f"{10 * k} %" for k in range(11))
RELAYS = ("mohed", "signal-strength", "random", "direct")


def scenario(
    *,
    relay: str = "direct",
    compression: int = 32,
    per: float | None = None,
    speed: float = 30.0,
    load: str = "probe",
    granularity: str = "frame",
    maximum_age: float = 1.0,
    brake_hold: float = 0.0,
    power: float = 26.0,
    trajectories: bool | None = None,
) -> dict[str, Any]:
    """Resolved, with what tells the condition."""
    sharing = {"compression": compression, "load": load, "loss_granularity": granularity}
    radio = (
        {"fmu": "channel", "parameters": {"transmit_power": f"{power} dBm"}}
        if per is None
        else {"type": "channel-constant-per", "parameters": {"per": per}}
    )
    return {
        "time": {"start": "0 s", "stop": "30 s"},
        "components": {
            "traffic": {
                "type": "sumo-traffic",
                "parameters": {"entities": {"ego": {"speed": f"{speed / 3.6!r} m/s"}}},
            },
            "facilities": {"type": "facilities", "parameters": sharing},
            "relay": {
                "type": f"relay-{relay}",
                "parameters": {} if trajectories is None else {"trajectories": trajectories},
            },
            "channel": radio,
            "policy": {
                "type": "policy-network",
                "parameters": {
                    "maximum_age": f"{maximum_age} s",
                    "brake_hold": f"{brake_hold} s",
                },
            },
        },
    }


def experiment(
    name: str,
    combinations: Sequence[tuple[Levels, Mapping[str, Any]]],
    *,
    seeds: int = 20,
    parameters: Mapping[str, Any] | None = None,
    metrics: Mapping[str, str] = METRICS,
) -> Experiment:
    return Experiment(
        path=Path(f"studies/collision/experiments/{name}.yaml"),
        scenario=Path("scenario.yaml"),
        seeds=tuple(range(101, 101 + seeds)),
        combinations=tuple(Combination(levels, (), made) for levels, made in combinations),
        metrics=metrics,
        report=ReportPlan(name="collision-study", parameters=parameters or {}),
        document=Document("study.yaml", {}, {}),
    )


def policies(seeds: int = 20) -> Experiment:
    each = [
        ({"policy": level}, scenario(per=0.0, compression=16 if level.endswith("16") else 32))
        for level in POLICY_LEVELS
    ]
    return experiment(POLICIES, each, seeds=seeds)


def constant_per(seeds: int = 20) -> Experiment:
    each = [
        (
            {"per": level, "compression": str(size)},
            scenario(per=float(level.split()[0]) / 100, compression=size),
        )
        for level in PERS
        for size in (16, 32)
    ]
    return experiment(CONSTANT_PER, each, seeds=seeds)


def speed(seeds: int = 20) -> Experiment:
    each = [
        ({"per": level}, scenario(per=float(level.split()[0]) / 100, speed=25.0)) for level in PERS
    ]
    return experiment("collision_speed", each, seeds=seeds)


def memory(seeds: int = 20) -> Experiment:
    each = [
        ({"per": level}, scenario(per=float(level.split()[0]) / 100, maximum_age=0.15))
        for level in PERS
    ]
    return experiment("collision_memory", each, seeds=seeds)


def relay(seeds: int = 20) -> Experiment:
    each = [
        (
            {"method": method, "compression": str(size), "speed": f"{speed} km/h"},
            scenario(relay=method, compression=size, speed=speed),
        )
        for method in RELAYS
        for size in (16, 32)
        for speed in (30, 25)
    ]
    return experiment(RELAY, each, seeds=seeds)


def radio(seeds: int = 20) -> Experiment:
    each = [
        ({"method": method, "power": f"{power} dBm"}, scenario(relay=method, power=power))
        for method in ("mohed", "direct")
        for power in (20, 10)
    ]
    return experiment(RADIO, each, seeds=seeds)


def load(seeds: int = 20) -> Experiment:
    each = [
        (
            {"method": method, "granularity": loss},
            scenario(relay=method, load="full", granularity=loss),
        )
        for method in ("mohed", "direct")
        for loss in ("frame", "packets", "keypoint")
    ]
    return experiment(LOAD, each, seeds=seeds)


def run(collision: bool, *, time: float | None = 10.0, prr: float | None = 0.9) -> dict[str, Any]:  # noqa: FBT001
    """The metrics of a run."""
    return {
        "collision": collision,
        "collision_time": 8.0 if collision else None,
        "collision_partner": "collision vehicle" if collision else None,
        "success": not collision and time is not None,
        "completion_time": None if collision else time,
        "prr": prr,
        "direct_prr": prr,
        "begin": 3.0,
        "served": prr,
        "relay_switches": 1,
        "min_gap_m": 0.0 if collision else 2.0,
    }


def chance(seed: int) -> float:
    """A number of 0 to 1 that belongs to a seed."""
    return (seed * 0.6180339887498949) % 1.0


def condition(**changed: Any) -> Condition:
    """Of the cooperative policy at a constant rate."""
    usual: dict[str, Any] = {
        "policy": "cooperative",
        "relay": "direct",
        "compression": 32,
        "speed_kmh": 30.0,
        "channel": "constant",
        "per": 0.0,
        "load": "probe",
        "granularity": "frame",
        "maximum_age": 1.0,
        "transmit_power": None,
    }
    return Condition(**{**usual, **changed})


def point(collisions: Sequence[bool], name: str = CONSTANT_PER, **changed: Any) -> Point:
    """Runs of the seeds 1 to n."""
    runs = {
        seed: Run(
            seed=seed,
            collision=happened,
            partner="background" if happened else "",
            success=not happened,
            completion_time=None if happened else 10.0,
            per=changed.get("per", 0.0),
            begin=3.0,
            served=1.0,
        )
        for seed, happened in enumerate(collisions, start=1)
    }
    return Point(name, condition(**changed), runs)


def first(hits: int, n: int) -> list[bool]:
    """`hits` collisions among `n` runs."""
    return [k < hits for k in range(n)]
