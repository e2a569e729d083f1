"""The component: SUMO traffic, entities that a scenario declares, and egos that policies drive."""

import fnmatch
import logging
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.sumo import connection
from adapters.sumo.checking import check_scene
from adapters.sumo.checks.outputs import unwritable
from adapters.sumo.checks.references import missing_references, names_taken
from adapters.sumo.connectors import connectors
from adapters.sumo.declarations import misdeclared
from adapters.sumo.driven import driven
from adapters.sumo.ego import Command
from adapters.sumo.files import SceneFiles, read_scene
from adapters.sumo.options import is_anybody_moved_here, sumo_options
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.rehearsal import rehearse
from adapters.sumo.simulation import Sumo
from adapters.sumo.traffic import Traffic
from adapters.sumo.warning_log import WarningLog
from orchestrator.component import ForeseenComponent, OncePerProcessComponent
from orchestrator.errors import Location, ParameterError, ParameterProblem, Problem
from orchestrator.input_files import FileCheck, FileReadingComponent, Finding
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, Time, nanoseconds, seconds

logger = logging.getLogger(__name__)

_MILLISECOND: Final = nanoseconds("0.001")


class SumoTraffic(FileReadingComponent, OncePerProcessComponent, ForeseenComponent):
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
        self._warnings: WarningLog | None = None
        self._traffic: Traffic | None = None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @classmethod
    @override
    def foreseen_connectors(cls) -> Mapping[str, Connector]:
        return connectors(("<entity>",))

    @classmethod
    @override
    def once_per_process(cls, parameters: TrafficParameters) -> str | None:
        is_elsewhere = parameters.traci or parameters.program != "libsumo"
        return None if is_elsewhere else "SUMO"

    @classmethod
    @override
    def input_files(cls, parameters: TrafficParameters) -> Iterable[Path]:
        return read_scene(parameters.scene)[0].paths()

    @classmethod
    @override
    def check_files(cls, parameters: TrafficParameters, *, thorough: bool) -> FileCheck:
        found = check_scene(
            parameters.scene,
            thorough=thorough and not parameters.traci,
            building_height=parameters.building_height,
        )
        wrong: tuple[Finding, ...] = (
            *(() if parameters.traci else unwritable(found.files)),
            *missing_references(parameters.entities, found.roads, found.types),
            *names_taken(parameters.entities, found.declared),
            *_mesoscopic(parameters, found.files),
        )
        has_own = bool(parameters.entities) or parameters.background is not None
        remarks: tuple[Finding, ...] = found.remarks
        if found.is_empty and not has_own:
            what = "neither the scene nor `entities` or `background` bring a vehicle or a person"
            remarks = (*remarks, Problem(Location(str(parameters.scene), 1, 1), what))
        remarks = (*remarks, *_idle_rules(parameters, found.types))
        problems = (*found.problems, *wrong)
        if thorough and has_own and not problems and not parameters.traci:
            rehearsed = rehearse(parameters, found.files)
            problems, remarks = rehearsed.problems, (*remarks, *rehearsed.remarks)
        return FileCheck(problems=problems, remarks=remarks)

    @classmethod
    def rehearse(
        cls, parameters: TrafficParameters, silent: Sequence[str], seed: int
    ) -> Sequence[str]:
        """Begin a run and end it before its first communication point.

        Args:
            parameters: of an instance.
            silent: options with which SUMO reads the scene and writes nothing.
            seed: of this draw.

        Returns:
            What is not wrong, but may not be meant, a sentence each.

        Raises:
            SumoError: what ends such a run; all of it that can be told at once.
        """
        said = dict(zip(silent[::2], silent[1::2], strict=True))
        said.pop("--remote-port", None)  # the connection says it
        options = {**sumo_options(parameters, seed), **said}
        sumo = Sumo(connection.start("libsumo", _flat(options)))
        try:
            return Traffic(sumo, parameters, np.random.default_rng(seed), 0).remarks()
        finally:
            sumo.close()

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self.close()
        at = self._parameters.origin
        origin = None if at is None else (at.x, at.y)
        self._sumo = Sumo(self._connect(int(rng.integers(2**31))), origin)
        if any(self._sumo.net.origin):
            logger.info("positions are relative to (%g, %g) m of the net", *self._sumo.net.origin)
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
        self._report()

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        count, rest = divmod(h, self._step_length)
        if rest:
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
        self._report()

    @override
    def outputs(self) -> Signals:
        assert self._traffic is not None  # noqa: S101
        return self._traffic.outputs

    @override
    def close(self) -> None:
        for what in [] if self._traffic is None else self._traffic.absent:
            logger.warning("%s", what)
        self._traffic = None
        try:
            if self._sumo is not None:
                self._sumo.close()
        finally:
            self._sumo = None
            if self._warnings is not None:
                self._warnings.close()
            self._warnings = None

    def _report(self) -> None:
        """Say in the log what SUMO warns of, and what may not be meant."""
        for what in [] if self._traffic is None else self._traffic.remarks():
            logger.warning("%s", what)
        if self._warnings is not None:
            self._warnings.read()

    def _connect(self, seed: int) -> connection.Connection:
        """Start SUMO with `seed` unless the parameters have another one, or join it."""
        given = self._parameters
        if given.traci:
            logger.info("SUMO at %s keeps its own seed and options", given.traci)
            return connection.join(given.traci, self._step_length)
        if is_anybody_moved_here(given):
            logger.info("SUMO teleports nobody in this run: entities are moved from outside")
        self._warnings = WarningLog(given.scene)
        options = sumo_options(given, seed)
        return connection.start(given.program, [*_flat(options), *self._warnings.options])


def _flat(options: Mapping[str, str]) -> list[str]:
    return [part for option in options.items() for part in option]


def _idle_rules(
    parameters: TrafficParameters, types: Collection[str]
) -> Iterator[ParameterProblem]:
    """Rules of equipment for types that the scene does not have."""
    for name, rule in parameters.equipment.items():
        if rule is not None and not fnmatch.filter(types, rule.types):
            what = f"no vehicle type of the scene matches `{rule.types}`: the rule has no effect"
            yield ParameterProblem(("equipment", name, "types"), what)


def _mesoscopic(parameters: TrafficParameters, files: SceneFiles) -> Iterator[ParameterProblem]:
    """Whoever would have to be on a lane of a scene that simulates queues."""
    for key in ("entities", "background"):
        if getattr(parameters, key) and files.is_on("mesosim"):
            what = f"SUMO has no lanes with `mesosim` in {files.config.name}; leave it out there"
            yield ParameterProblem((key,), what, at_key=True)


def _check(parameters: TrafficParameters) -> None:
    """Refuse parameters that do not fit together.

    Raises:
        ParameterError: all that is wrong.
    """
    problems = []
    if not parameters.scene.is_file():
        what = f"there is no file `{parameters.scene}`; name a *.sumocfg file"
        problems.append(ParameterProblem(("scene",), what))
    try:
        step_length = nanoseconds(parameters.step_length)
    except ValueError:
        step_length = 1
    if step_length % _MILLISECOND:
        what = f"is {parameters.step_length:g} s; SUMO counts whole milliseconds"
        problems.append(ParameterProblem(("step_length",), what))
    given = parameters.traci
    if given and not connection.is_address(given):
        what = f"is `{given}`; write HOST:PORT, for example localhost:8813"
        problems.append(ParameterProblem(("traci",), what))
    if given and parameters.program != "libsumo":
        what = "`traci` joins a program that runs already; leave one of them out"
        problems.append(ParameterProblem(("program",), what))
    if parameters.traci and parameters.scale is not None:
        what = "is an option of the SUMO that `traci` joins; start that one with `--scale`"
        problems.append(ParameterProblem(("scale",), what))
    problems += misdeclared(parameters.entities)
    if problems:
        raise ParameterError(problems)


__all__ = ["SumoTraffic"]
