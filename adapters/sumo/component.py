"""The component: SUMO traffic, entities that a scenario declares, and egos that policies drive."""

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.sumo import connection
from adapters.sumo.checking import check_scene
from adapters.sumo.checks.references import missing_references
from adapters.sumo.connectors import RESERVED, connectors
from adapters.sumo.driven import driven
from adapters.sumo.ego import Command
from adapters.sumo.entities import Entity
from adapters.sumo.files import read_scene
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.placement import place_of
from adapters.sumo.references import faults
from adapters.sumo.simulation import Sumo
from adapters.sumo.traffic import Traffic
from orchestrator.errors import ComponentTypeError, Location, Problem
from orchestrator.input_files import FileCheck, FileReadingComponent
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, Time, nanoseconds, seconds

logger = logging.getLogger(__name__)

_MILLISECOND: Final = nanoseconds("0.001")
_FARTHEST: Final = 1e6
"""From the origin [m]: farther is a mistake in writing."""


class SumoTraffic(FileReadingComponent):
    """Everybody on the roads of a SUMO scene, entities of the scenario, and egos to be driven.

    Every vehicle that SUMO has is signalled, and every person on foot. Each entity whose
    controller is `policy` has a group of connectors of its own name. Its command acts in the step
    that follows: no output depends on an input at the same communication point. Nothing happens to
    bodies that overlap with an ego's: the collision is reported, and both drive on.
    """

    Parameters: TypeAlias = TrafficParameters

    def __init__(self, parameters: TrafficParameters) -> None:
        _check(parameters)
        self._parameters = parameters
        self._step_length = nanoseconds(parameters.step_length)
        self._egos = tuple(driven(parameters.entities))
        self._connectors = connectors(self._egos)
        self._sumo: Sumo | None = None
        self._traffic: Traffic | None = None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @classmethod
    @override
    def input_files(cls, parameters: TrafficParameters) -> Iterable[Path]:
        return read_scene(parameters.scene)[0].paths()

    @classmethod
    @override
    def check_files(cls, parameters: TrafficParameters, *, thorough: bool) -> FileCheck:
        found = check_scene(parameters.scene, thorough=thorough and not parameters.traci)
        missing = tuple(missing_references(parameters.entities, found.roads, found.types))
        has_own = bool(parameters.entities) or parameters.background is not None
        remarks = found.remarks
        if found.is_empty and not has_own:
            what = "neither the scene nor `entities` or `background` bring a vehicle or a person"
            remarks = (*remarks, Problem(Location(str(parameters.scene), 1, 1), what))
        return FileCheck(problems=(*found.problems, *missing), remarks=remarks)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self.close()
        at = self._parameters.origin
        origin = None if at is None else (at.x, at.y)
        self._sumo = Sumo(self._connect(int(rng.integers(2**31))), origin)
        if any(self._sumo.origin):
            logger.info("positions are relative to (%g, %g) m of the net", *self._sumo.origin)
        with self._sumo.reached():
            begin = round(self._sumo.time * NANOSECONDS_PER_SECOND)
            if begin != start:
                logger.info(
                    "SUMO begins at %g s, the scenario at %g s; the run shows SUMO from its begin "
                    "on",
                    seconds(begin),
                    seconds(start),
                )
            self._traffic = Traffic(self._sumo, self._parameters, rng, start)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        count, rest = divmod(h, self._step_length)
        if rest or not count:
            raise ValueError(
                f"the communication step size is {h / 1e9:g} s, which is not a whole multiple of "
                f"SUMO's step, `step_length` = {self._parameters.step_length:g} s; "
                "change one of them"
            )
        commands = {
            name: Command.of(np.asarray(inputs[f"{name}.command"], np.float64))
            for name in self._egos
        }
        assert self._traffic is not None  # noqa: S101  (the contract: `setup` comes first)
        assert self._sumo is not None  # noqa: S101
        with self._sumo.reached():
            self._traffic.advance(commands, count)

    @override
    def outputs(self) -> Signals:
        assert self._traffic is not None  # noqa: S101
        return self._traffic.outputs

    @override
    def close(self) -> None:
        self._traffic = None
        if self._sumo is not None:
            self._sumo.close()
            self._sumo = None

    def _connect(self, seed: int) -> connection.Connection:
        """Start SUMO with `seed` unless the parameters have another one, or join it."""
        given = self._parameters
        if given.traci:
            logger.info("SUMO at %s keeps its own seed and options", given.traci)
            return connection.join(given.traci, self._step_length)
        options = {
            "--configuration-file": str(given.scene),
            "--step-length": f"{seconds(self._step_length):.3f}",
            "--seed": str(seed if given.sumo_seed is None else given.sumo_seed),
            "--no-step-log": "true",
            "--no-warnings": "true",
            "--duration-log.disable": "true",
        }
        if given.entities:  # their bodies are checked here, exactly; SUMO must not act
            options["--collision.action"] = "none"
        if any(entity is not None and entity.is_moved_here for entity in given.entities.values()):
            options["--time-to-teleport"] = "-1"  # or SUMO lifts those off the road that stand
            logger.info("SUMO teleports nobody in this run: entities are moved from outside")
        return connection.start(
            given.program, [part for option in options.items() for part in option]
        )


def _check(parameters: TrafficParameters) -> None:
    """Refuse parameters that do not fit together.

    Raises:
        ComponentTypeError: all that is wrong, one sentence each.
    """
    problems = []
    if not parameters.scene.is_file():
        problems.append(f"`scene`: there is no file `{parameters.scene}`; name a *.sumocfg file")
    try:
        step_length = nanoseconds(parameters.step_length)
    except ValueError:
        step_length = 1
    if step_length % _MILLISECOND:
        problems.append(
            f"`step_length` is {parameters.step_length:g} s; SUMO counts whole milliseconds"
        )
    for name, entity in parameters.entities.items():
        if entity is not None:
            found = [*_misdeclared(name, entity), *faults(entity, parameters.entities)]
            problems += [f"`entities.{name}`: {what}" for what in found]
    problems += _at_one_place(parameters.entities)
    if problems:
        raise ComponentTypeError("\n".join(problems))


def _misdeclared(name: str, entity: Entity) -> list[str]:
    """What is wrong with an entity, whatever the scene."""
    problems = []
    if entity.is_driven and name in RESERVED:
        problems.append("is the name of other connectors; call the entity otherwise")
    at = entity.position
    if (at.x is None) != (at.y is None):
        problems.append("`position` has only one of `x` and `y`; write both")
    if at.lane and at.x is not None:
        problems.append("`position` has both `lane` and `x`, `y`; leave one out")
    if any(not abs(value or 0.0) <= _FARTHEST for value in (at.x, at.y)):  # true for NaN
        problems.append(f"`position`: x and y must be finite and within +-{_FARTHEST:g} m")
    wanted = entity.synchronise
    if wanted is not None and wanted.min_speed > wanted.max_speed:
        problems.append("`synchronise.min_speed` is above `max_speed`")
    return problems


def _at_one_place(entities: Mapping[str, Entity | None]) -> list[str]:
    """Which roadside units stand where another one does: no radio can be nowhere from another."""
    problems = []
    known: dict[tuple[float, float], str] = {}
    for name, entity in entities.items():
        if entity is None or not entity.is_roadside_unit:
            continue
        at = place_of(entity.position.x, entity.position.y)
        first = name if at is None else known.setdefault(at, name)
        if at is not None and first != name:
            problems.append(
                f"`entities.{name}`: `position` is ({at[0]:g}, {at[1]:g}) m, the same place as "
                f"that of `entities.{first}`; leave one out"
            )
    return problems


__all__ = ["SumoTraffic"]
