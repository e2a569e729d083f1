"""Lives of instances of a unit: sound inputs that are not usual, and what importers do wrong."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from orchestrator.signal import Array
from tests.reliability.episodes.calls import CHANGE, CHANGE_KINDS, Calls, Mode, Table, What
from tests.reliability.episodes.messages import damaged, packets, received, scans
from tests.reliability.episodes.scenes import any_scene, spoilt
from tests.reliability.episodes.values import HOSTILE, hostile, valid

_PAIRED: Final = ("cca_threshold", "elevation_top", "elevation_bottom", "window_smallest")
"""Refused with most values of another parameter."""

_RATES: Final = (3e6, 4.5e6, 6e6, 9e6, 12e6, 18e6, 24e6, 27e6)
_STATES: Final = 4
_NUMBERS: Final = (0, 1, 2, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1)


@dataclass(slots=True)
class _Life:
    """What is known of one instance while its calls are written.

    Attributes:
        slot: its number.
        now: the time it has reached [s].
        sizes: the lengths of its arrays, by structural parameter.
        numbers: of its vehicles that have a radio, int64, shape (vehicle,).
        sent: how many packets it was given.
    """

    slot: int
    now: float = 0.0
    sizes: dict[str, int] = field(default_factory=dict)
    numbers: Array = field(default_factory=lambda: np.zeros(0, np.int64))
    sent: int = 0


class Author:
    """Writes the calls of one episode.

    Most inputs are sound, so that they get past the checks, and lie at the borders of what is
    allowed; `malice` is the share of calls that are not.
    """

    def __init__(self, table: Table, rng: np.random.Generator) -> None:
        """Write an episode of the unit that `table` describes, by chance from `rng`."""
        self.table = table
        self.rng = rng
        self.calls = Calls(table)
        self.malice = float(rng.choice((0.0, 0.02, 0.2), p=(0.6, 0.25, 0.15)))

    def write(self) -> Calls:
        """The whole episode."""
        lives = [_Life(slot) for slot in range(int(self.rng.choice((1, 1, 1, 2, 3))))]
        for life in lives:
            self._begin(life)
        for _ in range(int(self.rng.integers(2, 9))):
            self._go_on(lives[int(self.rng.integers(len(lives)))], lives)
        if self.rng.random() < 0.5:
            life = lives[0]
            self.calls.mode(life.slot, Mode.TERMINATE)
            self._strange(life)
        return self.calls

    def _happens(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def _begin(self, life: _Life) -> None:
        events = self._happens(0.1)
        self.calls.add(What.NEW, life.slot, a=float(events))
        self._live(life)
        if events:
            self.calls.mode(life.slot, Mode.STEP)

    def _live(self, life: _Life) -> None:
        """From the state Instantiated to stepping."""
        self.calls.mode(life.slot, Mode.CONFIGURE)
        scene = any_scene(self.rng, self.table)
        self._resize(life, scene)
        self._set_parameters(life)
        self._set_inputs(life, scene)
        self._strange(life)
        starts = (0.0, 0.0, 0.0, 1e-9, 1234.5, -3.0, 3.9e6, 1e12)
        life.now = float(self.rng.choice(starts[: 5 if self.malice == 0 else None]))
        self.calls.add(What.INITIALISE, life.slot, a=life.now, b=float("nan"))
        self._set_signals(life)
        self._strange(life)
        self._look(life)
        self.calls.mode(life.slot, Mode.INITIALISED)

    # ---- parameters and inputs

    def _resize(self, life: _Life, scene: dict[str, Array], *, is_first: bool = True) -> None:
        """In Configuration Mode: sizes as the scene needs them, or others."""
        for variable in self.table.of("structuralParameter"):
            if not is_first and variable.variability == "fixed" and not self._happens(self.malice):
                continue
            size = scene.get(variable.name)
            if size is None:
                size = valid(self.rng, variable)
                life.sizes[variable.name] = int(size[0])
            if self._happens(self.malice / 2):
                size = np.round(np.nan_to_num(hostile(self.rng, variable), posinf=2**62))
            self.calls.set(life.slot, variable.name, size)
        self.calls.mode(life.slot, Mode.CONFIGURED)

    def _set_parameters(self, life: _Life) -> None:
        found = self.table.of("parameter")
        count = min(len(found), int(self.rng.choice((0, 2, 6, 15, 40))))
        for k in self.rng.permutation(len(found))[:count]:
            variable = found[k]
            if variable.name in _PAIRED and not self._happens(0.1):
                continue
            length = 1
            for axis in variable.dimensions:
                length *= life.sizes.get(axis, 1) if isinstance(axis, str) else axis
            if self._happens(self.malice):
                value = hostile(self.rng, variable, length)
            elif variable.name == "bitrate":
                value = np.array(self.rng.choice(_RATES))
            else:
                value = valid(self.rng, variable, length)
            self.calls.set(life.slot, variable.name, value)

    def _set_inputs(self, life: _Life, scene: dict[str, Array]) -> None:
        if "vehicle.equipped" in scene:
            life.numbers = scene["vehicle.id"][scene["vehicle.equipped"]]
        values = {name: v for name, v in scene.items() if not name.startswith("n_")}
        if self._happens(self.malice) and any(np.size(v) for v in values.values()):
            values = spoilt(self.rng, values)
        for name, value in values.items():
            self.calls.set(life.slot, name, value)
        self._set_signals(life)

    def _set_signals(self, life: _Life) -> None:
        """The Binary inputs, and the number of the ego vehicle."""
        now = int(np.clip(life.now, -4e6, 9e9) * 1e9)
        signals: dict[str, bytes] = {}
        names = self.table.variables
        if "packets" in names:
            signals["packets"] = packets(self.rng, life.numbers, now, life.sent)
            life.sent += 100
        if "received" in names:
            signals["received"] = received(self.rng, now)
            signals["points"], carriers = scans(self.rng, now)
            ego = self.rng.choice(carriers) if len(carriers) else -1
            self.calls.set(life.slot, "ego.id", np.array(ego))
        for name, data in signals.items():
            sent = damaged(self.rng, data) if self._happens(self.malice) else data
            self.calls.set(life.slot, name, sent)

    # ---- steps

    def _go_on(self, life: _Life, lives: list[_Life]) -> None:
        """One of the things that an importer does between two steps, then a step."""
        match self.rng.integers(0, 12):
            case 0 | 1 | 2:
                scene = any_scene(self.rng, self.table)
                self.calls.mode(life.slot, Mode.CONFIGURE)
                self._resize(life, scene, is_first=False)
                self._set_inputs(life, scene)
            case 3:
                self._state(life, lives, is_damaged=False)
            case 4 | 5:
                self._state(life, lives, is_damaged=True)
            case 6:
                self.calls.mode(life.slot, Mode.RESET)
                life.sizes.clear()
                self._live(life)
            case 7:
                self._strange(life, 1.0 if self.malice else 0.1)
            case 8 if "received" in self.table.variables:
                other = lives[int(self.rng.integers(len(lives)))]
                self.calls.feed(other.slot, "apms", life.slot, "received")
            case _:
                pass
        for _ in range(int(self.rng.integers(1, 4))):
            self._set_signals(life)
            self._step(life)

    def _step(self, life: _Life) -> None:
        h = float(self.rng.choice((0.1, 0.1, 0.01, 1e-3, 1e-9, 1.0, 7.3)))
        beside = 0.0
        if self._happens(self.malice):
            h = float(self.rng.choice((*HOSTILE, 1e3, 3e6)))
        if self._happens(self.malice / 2):
            beside = float(self.rng.choice(HOSTILE))
        self.calls.add(What.ADVANCE, life.slot, a=beside, b=h)
        if 0 < h < 1e9 and beside == 0:
            life.now += h

    def _state(self, life: _Life, lives: list[_Life], *, is_damaged: bool) -> None:
        """Keep the state, perhaps change it, and let this or another instance take it."""
        slot = int(self.rng.integers(_STATES))
        self.calls.add(What.KEEP, life.slot, slot)
        if self._happens(0.5):
            self._step(life)
        if is_damaged:
            count = int(self.rng.choice((1, 1, 2, 5)))
            changes = np.zeros(count, CHANGE)
            changes["place"] = self.rng.random(count)
            changes["kind"] = self.rng.integers(0, CHANGE_KINDS, count)
            values = [int(n) for n in self.rng.integers(0, 256, count)]
            numbers = [_NUMBERS[n % len(_NUMBERS)] for n in values]
            floats = np.array([self.rng.choice(HOSTILE) for _ in range(count)]).view(np.uint64)
            chosen = self.rng.integers(0, 3, count)
            for k in range(count):
                changes["value"][k] = (values[k], numbers[k], int(floats[k]))[chosen[k]]
            self.calls.add(What.DAMAGE, reference=slot, data=changes.tobytes())
        target = lives[int(self.rng.integers(len(lives)))]
        self.calls.add(What.RETURN, target.slot, slot)
        self._look(target)

    # ---- what importers do besides, right or wrong

    def _look(self, life: _Life) -> None:
        outputs = self.table.of("output", "parameter")
        for k in self.rng.integers(0, len(outputs), 2):
            variable = outputs[k]
            self.calls.get(life.slot, variable.name, int(self.rng.choice((0, 1, 1, 1, 3, 1000))))

    def _strange(self, life: _Life, share: float | None = None) -> None:
        """Calls in a mode that does not have them, or of what there is not."""
        if not self._happens(self.malice if share is None else share):
            return
        for _ in range(int(self.rng.integers(1, 4))):
            match self.rng.integers(0, 5):
                case 0:
                    modes = (Mode.CONFIGURED, Mode.INITIALISED, Mode.EVENT, Mode.UPDATE, Mode.STEP,
                             Mode.LOGGING, Mode.UNSUPPORTED)  # fmt: skip
                    self.calls.mode(life.slot, modes[int(self.rng.integers(len(modes)))])
                case 1:
                    reference = int(self.rng.choice((0, 10**6, 2**32 - 1)))
                    self.calls.add(What.UNKNOWN, life.slot, reference, kind=1)
                case 2:
                    self.calls.add(What.INITIALISE, life.slot, a=float(self.rng.choice(HOSTILE)))
                case 3:
                    variables = list(self.table.variables.values())
                    variable = variables[int(self.rng.integers(len(variables)))]
                    if variable.type == "Binary":
                        self.calls.set(life.slot, variable.name, bytes(self.rng.bytes(20)))
                    else:
                        self.calls.set(life.slot, variable.name, hostile(self.rng, variable))
                case _:
                    self._look(life)


def episode(table: Table, seed: int, number: int) -> bytes:
    """The calls of an episode, which follow from `seed` and `number` only."""
    rng = np.random.default_rng([seed, number])
    return Author(table, rng).write().bytes(number)
