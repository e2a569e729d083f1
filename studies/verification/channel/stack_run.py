"""The files of one run of the whole Veins stack: `stack/<run>/`.

Coordinates are used as Veins has them, with y pointing down: what the channel sees is the mirror
image of the world. Losses, delays and the order of frames are the same in a mirror; only a sampled
antenna pattern would be seen the other way round, and these runs have isotropic antennas.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time
from studies.verification.channel.golden_files import (
    GoldenError,
    Table,
    nanoseconds,
    number,
    number_or_empty,
    read_json,
    read_table,
    text,
    whole,
)
from studies.verification.channel.session import VEINS_ANTENNA_HEIGHT, vehicle_inputs
from studies.verification.channel.stack_parameters import RunParameters, run_parameters

FILES: Final = (
    "run.json",
    "buildings.json",
    "vehicles.csv",
    "positions.csv.gz",
    "tx.csv.gz",
    "rx_events.csv.gz",
)
"""What must be there; `pairs.csv` may be, and `sumo` holds what made the positions."""
PAIRS: Final = "pairs.csv"
_CLASSES: Final = {
    "decoded": ("received", "lost_noise", "lost_interference"),
    "B": ("lost_rx_locked_on_other",),
    "T": ("lost_rx_transmitting",),
    "U": ("below_min_power",),
}
"""The columns of `pairs.csv` that make each class."""
_LETTERS: Final = {"decoded": "RNC", "B": "B", "T": "T", "U": "U"}
"""The outcomes that make each class."""


@dataclass(frozen=True, slots=True)
class Update:
    """The vehicles from one time on.

    Attributes:
        time: of the update [ns].
        vehicles: inputs of the channel.
        antennas: positions [m], shape (vehicle, 3).
    """

    time: Time
    vehicles: Mapping[str, Array]
    antennas: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Frames:
    """Frames that were sent, in the order of the file.

    Attributes:
        vehicle: the transmitter, shape (frame,).
        sequence: number of the frame at the transmitter, shape (frame,).
        queued: when it is handed to the medium access [ns], shape (frame,).
        start: when it goes on air [ns], shape (frame,).
        duration: how long it is on air [ns], shape (frame,).
        antenna: position of the transmitter's antenna [m], shape (frame, 3).
    """

    vehicle: Array
    sequence: Array
    queued: Array
    start: Array
    duration: Array
    antenna: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Events:
    """Arrivals of frames at vehicles, in the order of the file.

    Attributes:
        time: when the frame begins at the receiver [ns], shape (event,).
        frame: index in `Frames`, or -1 for a frame that is not listed, shape (event,).
        receiver: a vehicle, shape (event,).
        outcome: index in `OUTCOMES`, shape (event,).
        power: received power [dBm], shape (event,).
        snir: lowest SNIR over the frame [dB], shape (event,); NaN where nothing was decoded.
    """

    time: Array
    frame: Array
    receiver: Array
    outcome: Array
    power: Array
    snir: Array


@dataclass(frozen=True, slots=True)
class PairTotals:
    """How many frames of each class arrived over the whole run, by ordered pair of vehicles.

    Under given transmit times the classes U, T and B and the decoded frames of every pair are
    determined, also in the part of the run whose single events are not recorded.

    Attributes:
        pair: transmitters and receivers, shape (pair, 2).
        classes: how many frames, shape (pair,), by class.
    """

    pair: Array
    classes: dict[str, Array]

    def differences(self, name: str, names: tuple[str, ...], received: Array) -> list[str]:
        """Compare with RECEPTION records: a sentence for each pair and class that differs.

        Args:
            name: of the run.
            names: of the vehicles.
            received: RECEPTION records, shape (reception,).
        """
        found = []
        for label, golden in self.classes.items():
            outcomes = [OUTCOMES.index(letter) for letter in _LETTERS[label]]
            of_class = received[np.isin(received["outcome"], outcomes)]
            counts = np.zeros((len(names), len(names)), np.int64)
            np.add.at(counts, (of_class["transmitter"], of_class["receiver"]), 1)
            ours = counts[self.pair[:, 0], self.pair[:, 1]]
            found += [
                f"{name}/{PAIRS}: {names[self.pair[k, 0]]} to {names[self.pair[k, 1]]}: golden "
                f"{golden[k]} of class {label}, ours {ours[k]}"
                for k in np.flatnonzero(golden != ours)
            ]
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class StackRun:
    """One run.

    Attributes:
        name: `stack/<run>`.
        parameters: of the run.
        names: of the vehicles; their numbers are the places in this list, the order in which
            they appear.
        rings: corners of the buildings.
        updates: in the order of time, one every `parameters.interval`.
        frames: sent.
        events: at receivers.
        pair_totals: of the whole run; `None` if they are not given.
    """

    name: str
    parameters: RunParameters
    names: tuple[str, ...]
    rings: tuple[Sequence[Sequence[float]], ...]
    updates: tuple[Update, ...]
    frames: Frames
    events: Events
    pair_totals: PairTotals | None

    def updates_at(self, times: Array) -> Array:
        """Find the update that holds at each time; the first one holds before it, too.

        Args:
            times: when [ns], shape (n,).

        Returns:
            Indices of updates, shape (n,).
        """
        starts = [update.time for update in self.updates]
        return np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)

    def antennas(self, updates: Array, vehicles: Array) -> Array:
        """Find where the antennas of vehicles are during updates.

        Args:
            updates: indices, shape (n,).
            vehicles: numbers, shape (n,).

        Returns:
            Positions [m], shape (n, 3); NaN if nowhere.
        """
        where = np.full((len(self.updates), len(self.names), 3), np.nan)
        for k, update in enumerate(self.updates):
            where[k, update.vehicles["vehicle.id"]] = update.antennas
        found: Array = where[updates, vehicles]
        return found

    def counted(self, receptions: Array) -> Array:
        """Choose those of RECEPTION records, shape (n,), that ended before the simulation did."""
        found: Array = receptions[receptions["time"] <= self.parameters.end]
        return found

    def place(self, frame: int, receiver: int) -> str:
        """Say which event it is, for messages."""
        tx = self.names[int(self.frames.vehicle[frame])]
        time = int(self.frames.start[frame]) / 1e9
        number = int(self.frames.sequence[frame])
        return f"{self.name}: {tx}, seq {number}, to {self.names[receiver]}, at {time:.9f} s"


def read_run(folder: Path) -> StackRun:
    """Read the run in `folder`.

    Raises:
        GoldenError: a file is missing or malformed.
    """
    name = f"stack/{folder.name}"
    if missing := [file for file in FILES if not (folder / file).is_file()]:
        raise GoldenError([f"{name}: the file `{file}` is missing" for file in missing])
    parameters = run_parameters(read_json(folder / "run.json", f"{name}/run.json"))
    positions = _positions(folder, name)
    numbers = {vehicle: k for k, vehicle in enumerate(dict.fromkeys(positions["veh"]))}
    sizes = _sizes(folder, name, numbers)
    frames = _frames(folder, name, numbers)
    return StackRun(
        name=name,
        parameters=parameters,
        names=tuple(numbers),
        rings=_rings(folder, name, parameters),
        updates=_updates(positions, numbers, sizes, parameters.interval),
        frames=frames,
        events=_events(folder, name, numbers, frames),
        pair_totals=_pair_totals(folder, name, numbers),
    )


def _rings(
    folder: Path, name: str, parameters: RunParameters
) -> tuple[Sequence[Sequence[float]], ...]:
    node = read_json(folder / "buildings.json", f"{name}/buildings.json")
    if parameters.channel["building_shadowing"]:
        for key, parameter in (("db_per_cut", "wall_loss"), ("db_per_meter", "indoor_loss")):
            if key in node and node[key].number() != parameters.channel[parameter]:
                raise node[key].problem(
                    f"is {node[key].number():g}, but {parameters.channel[parameter]:g} in run.json"
                )
    return tuple(building["shape_veins"].ring() for building in node["buildings"])


def _positions(folder: Path, name: str) -> Table:
    columns = {"t_veins": nanoseconds, "veh": text}
    columns |= dict.fromkeys(("x", "y", "dir_x", "dir_y"), number)
    return read_table(folder / "positions.csv.gz", f"{name}/positions.csv.gz", columns)


def _sizes(folder: Path, name: str, numbers: Mapping[str, int]) -> Array:
    """Length, width and height of each vehicle, shape (vehicle, 3)."""
    dimensions = ("length", "width", "height")
    columns = {"veh": text, **dict.fromkeys(dimensions, number)}
    table = read_table(folder / "vehicles.csv", f"{name}/vehicles.csv", columns)
    sizes = np.full((len(numbers), 3), np.nan)
    for row, vehicle in enumerate(table["veh"]):
        if vehicle in numbers:
            sizes[numbers[vehicle]] = [table[dimension][row] for dimension in dimensions]
            if min(sizes[numbers[vehicle]]) <= 0:
                raise table.problem(row, "length, width and height must be positive")
    for vehicle, k in numbers.items():
        if np.isnan(sizes[k]).any():
            raise GoldenError([f"{name}/vehicles.csv: `{vehicle}` is missing"])
    return sizes


def _updates(
    positions: Table, numbers: Mapping[str, int], sizes: Array, interval: Duration
) -> tuple[Update, ...]:
    time = positions["t_veins"]
    nobody = Update(0, vehicle_inputs([], [], [], []), np.empty((0, 3)))
    vehicle = positions.numbers_of("veh", numbers)
    wrong = np.flatnonzero((np.diff(time) < 0) | ((time[1:] - time[0]) % interval != 0))
    if len(wrong):
        raise positions.problem(
            int(wrong[0]) + 1, f"t_veins: is not a multiple of {interval / 1e9:g} s after the first"
        )
    found: list[Update] = []
    cuts = [0, *(np.flatnonzero(np.diff(time)) + 1).tolist(), len(time)]
    for first, last in itertools.pairwise(cuts):
        after = found[-1].time + interval if found else int(time[first])
        gap = range(after, int(time[first]), interval)
        found += [dataclasses.replace(nobody, time=empty) for empty in gap]
        rows = first + np.argsort(vehicle[first:last], kind="stable")
        if (np.diff(vehicle[rows]) == 0).any():
            raise positions.problem(first, "a vehicle is listed twice at this time")
        front = np.stack([positions["x"][rows], positions["y"][rows]], axis=-1)
        heading = np.arctan2(positions["dir_y"][rows], positions["dir_x"][rows])
        found.append(
            Update(
                int(time[first]),
                vehicle_inputs(vehicle[rows], front, heading, sizes[vehicle[rows]]),
                np.insert(front, 2, VEINS_ANTENNA_HEIGHT, axis=1),
            )
        )
    return tuple(found)


def _frames(folder: Path, name: str, numbers: Mapping[str, int]) -> Frames:
    columns = {"tx": text, "seq": whole, "t_queued": nanoseconds, "t_tx_start": nanoseconds}
    columns |= dict.fromkeys(("x", "y", "z", "duration_us"), number)
    table = read_table(folder / "tx.csv.gz", f"{name}/tx.csv.gz", columns)
    vehicle = table.numbers_of("tx", numbers)
    names = np.stack([vehicle, table["seq"]], axis=-1)
    _, first = np.unique(names, axis=0, return_index=True)
    if len(first) < len(names):
        row = int(np.setdiff1d(np.arange(len(names)), first)[0])
        raise table.problem(row, "seq: the vehicle has sent a frame of this number before")
    late = np.flatnonzero(table["t_tx_start"] < table["t_queued"])
    if len(late):
        raise table.problem(int(late[0]), "t_tx_start: lies before t_queued")
    return Frames(
        vehicle=vehicle,
        sequence=table["seq"],
        queued=table["t_queued"],
        start=table["t_tx_start"],
        duration=np.round(table["duration_us"] * 1e3).astype(np.int64),
        antenna=np.stack([table[axis] for axis in "xyz"], axis=-1),
    )


def _events(folder: Path, name: str, numbers: Mapping[str, int], frames: Frames) -> Events:
    columns = {
        "t_rx_start": nanoseconds,
        "tx": text,
        "seq": whole,
        "rx": text,
        "outcome": text,
        "rx_dbm": number,
        "min_sinr_db": number_or_empty,
    }
    table = read_table(folder / "rx_events.csv.gz", f"{name}/rx_events.csv.gz", columns)
    known = {
        (vehicle, sequence): k
        for k, (vehicle, sequence) in enumerate(
            zip(frames.vehicle.tolist(), frames.sequence.tolist(), strict=True)
        )
    }
    vehicle = table.numbers_of("tx", numbers).tolist()
    keys = zip(vehicle, table["seq"].tolist(), strict=True)
    return Events(
        time=table["t_rx_start"],
        frame=np.array([known.get(key, -1) for key in keys], np.int64),
        receiver=table.numbers_of("rx", numbers),
        outcome=table.numbers_of("outcome", {letter: k for k, letter in enumerate(OUTCOMES)}),
        power=table["rx_dbm"],
        snir=table["min_sinr_db"],
    )


def _pair_totals(folder: Path, name: str, numbers: dict[str, int]) -> PairTotals | None:
    """The totals of the run, if it has them."""
    if not (folder / PAIRS).exists():
        return None
    columns = {"tx": text, "rx": text}
    counts = dict.fromkeys((c for group in _CLASSES.values() for c in group), whole)
    table = read_table(folder / PAIRS, f"{name}/{PAIRS}", {**columns, **counts})
    ends = [table.numbers_of(end, numbers) for end in ("tx", "rx")]
    classes = {
        label: np.sum([table[column] for column in group], axis=0)
        for label, group in _CLASSES.items()
    }
    return PairTotals(np.stack(ends, axis=-1), classes)
