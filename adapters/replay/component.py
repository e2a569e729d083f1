"""The component: traffic from a file."""

import json
from collections.abc import Generator, Iterable, Mapping
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.replay.findings import Findings, TrafficFileError
from adapters.replay.kinds import Kind, Kinds, read_kinds
from adapters.replay.motion import between
from adapters.replay.parameters import ReplayParameters
from adapters.replay.source import MOST_SAMPLES, Frame, Source
from adapters.replay.surroundings import Surroundings, read_surroundings
from adapters.replay.tracks import Roster, Tracks, Window
from adapters.traffic.connectors import SURROUNDINGS, VEHICLES
from adapters.traffic.geometry import direction
from adapters.traffic.surroundings import Buildings, RoadSurface
from orchestrator.errors import ComponentTypeError
from orchestrator.input_files import FileCheck, FileReadingComponent, named_files
from orchestrator.signal import Array, Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds, seconds

_CONNECTORS: Final[Mapping[str, Connector]] = {**VEHICLES, **SURROUNDINGS}


class FcdReplay(FileReadingComponent):
    """Traffic replayed from a file: SUMO's floating car data, CSV or Parquet.

    It reads the file as the run goes on, `maximum_gap` ahead, so that the file may be larger than
    the memory. The first 100,000 samples are checked when the component is made, all others when
    they are read. Numbers, and what is drawn for a road user, depend on the file and the seed
    alone: neither on where in the file the run begins, nor on the communication step size.
    """

    Parameters: TypeAlias = ReplayParameters

    connectors = _CONNECTORS

    def __init__(self, parameters: ReplayParameters) -> None:
        self._parameters = parameters
        problems: list[str] = []
        self._offset = _whole(parameters.offset, "offset", problems)
        self._gap = _whole(parameters.maximum_gap, "maximum_gap", problems)
        kinds = Kinds(_declared(parameters, problems), parameters.antenna_above_roof)
        found = _surroundings(parameters)
        self._buildings, self._road = found.buildings, found.road
        problems += found.problems
        if problems:
            raise ComponentTypeError("\n".join(problems))
        self._source = Source(parameters.file, kinds, parameters.convention)
        self._check_head()
        self._frames: Generator[Frame, None, None] | None = None
        self._window: Window | None = None
        self._outputs: Signals = {}

    @classmethod
    @override
    def input_files(cls, parameters: ReplayParameters) -> Iterable[Path]:
        return named_files(parameters)

    @classmethod
    @override
    def check_files(cls, parameters: ReplayParameters, *, thorough: bool) -> FileCheck:
        """What may not be meant; what is wrong is said when the component is made."""
        del thorough
        return FileCheck(remarks=_surroundings(parameters).remarks)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self.close()
        self._frames = self._source.frames()
        roster = Roster(self._parameters.equipment, self._gap, rng)
        self._window = Window(self._frames, roster, self._gap)
        self._show(start, np.zeros(0, np.int64))

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._show(t + h, np.asarray(self._outputs["vehicle.id"]))

    @override
    def outputs(self) -> Signals:
        return self._outputs

    @override
    def close(self) -> None:
        if self._frames is not None:
            self._frames.close()
            self._frames = self._window = None

    def _show(self, t: Time, before: Array) -> None:
        """Set the outputs to those at `t`; `before` are the numbers of the last ones."""
        assert self._window is not None  # noqa: S101  (the contract: `setup` comes first)
        time = t + self._offset
        last, following = self._window.at(time)
        self._check_time(self._window, t, time)
        state = between(last, following, time, self._parameters.interpolation)
        self._outputs = _signals(state, before, self._buildings, self._road)

    def _check_time(self, window: Window, t: Time, time: Time) -> None:
        """Refuse a time that the file does not cover, if that is wanted.

        Raises:
            TrafficFileError: it does not.
        """
        is_after = window.is_read and time > window.last
        if self._parameters.outside == "empty" or not (time < window.first or is_after):
            return
        end = f"ends at {_shown(window.last)}" if window.is_read else "goes on"
        raise TrafficFileError(
            f"{self._parameters.file}: the file begins at {_shown(window.first)} and {end}; at the "
            f"communication point {_shown(t)} it would be shown at {_shown(time)} (`offset` is "
            f"{_shown(self._offset)}). Change `offset` or the `time` of the scenario, or say "
            "`outside: empty`"
        )

    def _check_head(self) -> None:
        """Read the begin of the file; a small file is read whole.

        Raises:
            TrafficFileError: it is wrong, or `maximum_gap` is too short for it.
        """
        frames = self._source.frames()
        first = next(frames)
        second = next(frames, first)
        samples = len(first.names) + len(second.names)
        stay = set(first.keys) & set(second.keys)
        apart = second.time - first.time
        for frame in frames:
            samples += len(frame.names)
            if samples >= MOST_SAMPLES:
                break
        frames.close()
        if stay and apart > self._gap:
            raise TrafficFileError(
                f"{self._parameters.file}: the first two times are {_shown(apart)} apart, more than"
                f" `maximum_gap` = {_shown(self._gap)}, so that everyone would leave at once; set "
                f"`maximum_gap` to {_shown(apart)} or more"
            )


def _shown(time: Time) -> str:
    return f"{seconds(time):.9g} s"


def _whole(value: float, name: str, problems: list[str]) -> Duration:
    """Nanoseconds; that they are no whole number is a problem."""
    try:
        return nanoseconds(value)
    except ValueError as error:
        problems.append(f"`{name}`: {error}")
        return 0


def _declared(parameters: ReplayParameters, problems: list[str]) -> Mapping[str, Kind]:
    """The types of `types_file`."""
    if parameters.types_file is None:
        return {}
    findings = Findings(parameters.types_file)
    kinds = read_kinds(parameters.types_file, findings)
    problems += findings.lines(str)
    return kinds


def _surroundings(parameters: ReplayParameters) -> Surroundings:
    return read_surroundings(parameters.buildings, parameters.net, parameters.building_height)


def _signals(state: Tracks, before: Array, buildings: Buildings, road: RoadSurface) -> Signals:
    """The outputs, of who is there now and of who has entered since `before`."""
    position = np.zeros((len(state), 3))
    position[:, :2] = state["center"]
    entered = state[~np.isin(state["number"], before, assume_unique=True)]
    arrays: dict[str, Array] = {
        "vehicle.id": state["number"].copy(),
        "vehicle.position": position,
        "vehicle.velocity": state["speed"][:, None] * direction(state["heading"]),
        "vehicle.role": np.zeros(len(state), np.int32),
        "building.vertex": buildings.vertex,
        "building.index": buildings.index,
        "building.height": buildings.height,
        "road.vertex": road.vertex,
        "road.index": road.index,
    }
    for name in ("heading", "size", "antenna_height", "body", "equipped", "lidar"):
        arrays[f"vehicle.{name}"] = state[name].copy()
    for array in arrays.values():
        array.flags.writeable = False
    people = [[int(row["number"]), row["name"], row["type"]] for row in entered]
    return {**arrays, "entered": json.dumps(people, separators=(",", ":")).encode()}


__all__ = ["FcdReplay"]
