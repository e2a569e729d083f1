"""Where two recordings of one scenario begin to differ, byte for byte."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.recording.reader import Recording, Series
from orchestrator.signal import Array, Signal
from orchestrator.timebase import Time, seconds

_CHUNK: Final = 256
"""Samples that are compared at once."""

_LONGEST: Final = 60
"""Characters of a value that are shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """The first sample of a signal that is not the same in two recordings.

    Attributes:
        signal: `component.connector`.
        time: of the communication point [ns]; `None` if the signals differ in kind.
        element: index of the first element that differs; empty where there is but one, or where the
            samples differ in size.
        then, now: the values there in the first and the second recording, as text.
    """

    signal: str
    time: Time | None
    element: tuple[int, ...]
    then: str
    now: str

    @override
    def __str__(self) -> str:
        index = f"[{', '.join(map(str, self.element))}]" if self.element else ""
        at = "" if self.time is None else f" at t = {seconds(self.time):.9g} s"
        return f"`{self.signal}{index}`{at} was {self.then}, and is {self.now}"


def differences(then: Recording, now: Recording) -> list[Difference]:
    """The first difference of every signal that has one, the earliest first.

    Signals that differ at the same time stand in the order of the turns in which components step,
    as the manifest of the first recording says them; what differs in kind stands first.

    Raises:
        RecordingError: a file is damaged.
    """
    turns = [str(name) for name in then.manifest.get("turns", ())]
    names = list(dict.fromkeys((*then.signals, *now.signals)))
    found = [each for name in names if (each := _first(then, now, name)) is not None]

    def place(each: Difference) -> tuple[Time, int]:
        component = each.signal.partition(".")[0]
        turn = turns.index(component) if component in turns else len(turns)
        return (-1 if each.time is None else each.time, turn)

    return sorted(found, key=place)


def _first(then: Recording, now: Recording, name: str) -> Difference | None:
    recordings = (then, now)
    if not all(name in each for each in recordings):
        said = ["recorded" if name in each else "not recorded" for each in recordings]
        return Difference(signal=name, time=None, element=(), then=said[0], now=said[1])
    old, new = then[name], now[name]
    kinds = [f"{each.kind} in {each.unit}" for each in (old, new)]
    if kinds[0] != kinds[1]:
        return Difference(signal=name, time=None, element=(), then=kinds[0], now=kinds[1])
    count = min(len(old), len(new))
    for k in _suspects(old, new, count):
        if old.times[k] != new.times[k]:
            time = int(min(old.times[k], new.times[k]))
            said = [_published(each, k, time) for each in (old, new)]
            return Difference(signal=name, time=time, element=(), then=said[0], now=said[1])
        found = _in_sample(old[k], new[k])
        if found is not None:
            element, was, is_now = found
            time = int(old.times[k])
            return Difference(signal=name, time=time, element=element, then=was, now=is_now)
    if len(old) != len(new):
        time = int((old if len(old) > len(new) else new).times[count])
        said = [_published(each, count, time) for each in (old, new)]
        return Difference(signal=name, time=time, element=(), then=said[0], now=said[1])
    return None


def _published(series: Series, k: int, time: Time) -> str:
    there = k < len(series) and int(series.times[k]) == time
    return "published" if there else "not published"


def _suspects(old: Series, new: Series, count: int) -> Iterator[int]:
    """Samples among which the first is that differs, if any does."""
    for start in range(0, count, _CHUNK):
        end = min(start + _CHUNK, count)
        same = np.array_equal(old.times[start:end], new.times[start:end])
        same = same and np.array_equal(old.lengths[start:end], new.lengths[start:end])
        same = same and old.between(start, end).tobytes() == new.between(start, end).tobytes()
        if not same or old.kind.count(",") > 0:  # of several axes the shapes may differ alone
            yield from range(start, end)


def _in_sample(then: Signal, now: Signal) -> tuple[tuple[int, ...], str, str] | None:
    """The first element of two samples that differs, and its values."""
    if isinstance(then, bytes) or isinstance(now, bytes):
        return _in_bytes(bytes(then), bytes(now))
    old, new = np.asarray(then), np.asarray(now)
    if old.shape != new.shape:
        return (), f"of shape {_shape(old)}", f"of shape {_shape(new)}"
    if old.tobytes() == new.tobytes():
        return None
    width = old.dtype.itemsize
    raw = [np.frombuffer(each.tobytes(), np.uint8).reshape(-1, width) for each in (old, new)]
    flat = int(np.flatnonzero((raw[0] != raw[1]).any(axis=1))[0])
    index = tuple(int(i) for i in np.unravel_index(flat, old.shape))
    return index, _value(old[index]), _value(new[index])


def _in_bytes(then: bytes, now: bytes) -> tuple[tuple[int, ...], str, str] | None:
    if then == now:
        return None
    if len(then) != len(now):
        return (), f"{len(then)} bytes", f"{len(now)} bytes"
    pairs = zip(then, now, strict=True)
    k = next(k for k, (one, other) in enumerate(pairs) if one != other)
    return (k,), f"0x{then[k]:02x}", f"0x{now[k]:02x}"


def _shape(array: Array) -> str:
    return " x ".join(map(str, array.shape)) or "1"


def _value(value: Any) -> str:
    text = repr(value.item()) if isinstance(value, np.generic) else repr(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
