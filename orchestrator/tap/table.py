"""What the messages of a tap come to, as a table: rate, age, value and course of each signal."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from orchestrator.byte_size import format_size
from orchestrator.patterns import meant
from orchestrator.remote.block import WireError
from orchestrator.signal import Connector, Signal
from orchestrator.tap.stream import PUBLICATIONS, PUBLISHED, Kind, Message, Schema
from orchestrator.timebase import Time, seconds

_COURSE: Final = 24
"""Values that a course has at most."""

_WINDOW: Final = 20
"""Messages over which rates are taken."""

_BLOCKS: Final = "▁▂▃▄▅▆▇█"
_LONGEST_TEXT: Final = 40


@dataclass(slots=True)
class Row:
    """One signal.

    Attributes:
        connector: its declaration.
        value: the last one; `None` if there was none.
        course: numbers that stand for its last values: those of a scalar, means of arrays.
    """

    connector: Connector
    value: Signal | None = None
    course: deque[float] = field(default_factory=lambda: deque(maxlen=_COURSE))

    def note(self, value: Signal) -> None:
        """Take the next value, an array of any shape or bytes."""
        self.value = value
        number = _number(value)
        if number is not None:
            self.course.append(number)


class Table:
    """The state of a run, as far as the messages of a tap tell it.

    Args:
        asked: names and patterns of the signals to show; all, if there are none.

    Attributes:
        unknown: of `asked`, what means no signal of the run.
        schema: what is shown.
        time: the last communication point [ns].
        points: how many there were.
        wall: wall time that the run has taken [s].
        left_out: messages that were missed because this reader was slow.
        ending: how the run ended, as text; empty while it goes on.
        status: `running`, `done`, `failed` or `interrupted`.
        rows: by signal.
    """

    def __init__(self, asked: Sequence[str] = ()) -> None:
        self._asked = tuple(asked)
        self.unknown: tuple[str, ...] = ()
        self.schema: Schema | None = None
        self.time: Time = 0
        self.points = 0
        self.wall = 0.0
        self.left_out = 0
        self.status = "running"
        self.ending = ""
        self.rows: dict[str, Row] = {}
        self._published: Mapping[str, int] = {}
        self._counts: deque[tuple[Time, float, Mapping[str, int]]] = deque(maxlen=_WINDOW)

    def take(self, message: Message, schema: Schema | None) -> None:
        """Take the next message.

        Args:
            message: as decoded.
            schema: of the stream that it came in.

        Raises:
            WireError: the message does not fit its schema.
        """
        self.time = message.t
        self.points = max(self.points, message.points)
        self.left_out += message.left_out
        if message.kind is Kind.SCHEMA and schema is not None:
            self.schema = schema
            self.time = schema.start
            own = (PUBLISHED, PUBLICATIONS)
            offered = [name for name in schema.connectors if name not in own]
            found = {each: meant(each, offered) for each in self._asked}
            self.unknown = tuple(each for each, names in found.items() if not names)
            shown = {name for names in found.values() for name in names} or set(offered)
            names = [name for name in offered if name in shown]
            self.rows = {name: Row(schema.connectors[name]) for name in names}
        elif message.kind is Kind.VALUES and message.values is not None and schema is not None:
            self.wall = message.wall / 1e9
            values = dict(message.values)
            self._published = _by_component(schema, values.pop(PUBLISHED, None))
            counts = _by_component(schema, values.pop(PUBLICATIONS, None))
            self._counts.append((message.t, self.wall, counts))
            for name in values.keys() & self.rows.keys():
                self.rows[name].note(values[name])
        elif message.kind is Kind.END and message.document is not None:
            self.status = str(message.document.get("status"))
            said = message.document.get("error") or message.document.get("ended_early")
            self.ending = self.status if said is None else f"{self.status}: {said}"

    @property
    def speed(self) -> float:
        """Simulated seconds per second of wall time, lately; NaN if it cannot be said."""
        if len(self._counts) < 2:
            return math.nan
        (first, since, _), (last, until, _) = self._counts[0], self._counts[-1]
        return seconds(last - first) / (until - since) if until > since else math.nan

    def rate(self, name: str) -> float:
        """How often the signal's component publishes, lately [Hz of simulated time]."""
        if len(self._counts) < 2:
            return math.nan
        component = name.partition(".")[0]
        (first, _, before), (last, _, after) = self._counts[0], self._counts[-1]
        if last == first:
            return math.nan
        return (after.get(component, 0) - before.get(component, 0)) / seconds(last - first)

    def age(self, name: str) -> float:
        """How long ago the signal's component published last [s of simulated time]."""
        published = self._published.get(name.partition(".")[0])
        return math.nan if published is None else seconds(self.time - published)

    def lines(self, width: int, height: int) -> list[str]:
        """The table as text.

        Args:
            width: columns at most.
            height: lines at most; what has no room is counted.
        """
        lines = [self._head()]
        names = list(self.rows)
        room = max(1, height - 2 - len(self.unknown))
        shown = names if len(names) <= room else names[: room - 1]
        longest = max(map(len, shown), default=0)
        for name in shown:
            row = self.rows[name]
            head = f"{name:{longest}}  {_brief(self.rate(name)):>7} Hz  {_age(self.age(name)):>8}"
            text = text_of(row) or self._silence()
            lines.append(f"{head}  {sparkline(row.course):{_COURSE}}  {text}")
        if len(shown) < len(names):
            lines.append(f"and {len(names) - len(shown)} more; name some, or patterns of them")
        lines += [f"no signal is called `{each}`, or matches it" for each in self.unknown]
        if self.ending:
            lines.append(self.ending)
        return [line[:width].rstrip() for line in lines]

    def data(self) -> dict[str, Any]:
        """The table in terms of JSON."""
        return {
            "run": None if self.schema is None else self.schema.run,
            "status": self.status,
            "time_s": seconds(self.time),
            "points": self.points,
            "left_out": self.left_out,
            "unknown": list(self.unknown),
            "signals": {
                name: {
                    "rate_hz": _finite(self.rate(name)),
                    "age_s": _finite(self.age(name)),
                    "unit": row.connector.unit,
                    **_summary(row.value),
                }
                for name, row in self.rows.items()
            },
        }

    def _silence(self) -> str:
        """What there is to say of a signal without a value."""
        largest = None if self.schema is None else self.schema.largest
        if largest is None or len(self._counts) == 0:
            return "nothing yet"
        return f"more than {format_size(largest)}: name it to see it"

    def _head(self) -> str:
        stop = "" if self.schema is None else f" of {seconds(self.schema.stop):g}"
        head = f"t = {seconds(self.time):.3f}{stop} s"
        if math.isfinite(self.speed):
            head += f", {self.speed:.3g} simulated seconds per second"
        return head + (f", {self.left_out} messages left out" if self.left_out else "")


def sparkline(course: "deque[float]") -> str:
    """Numbers as small bars; the least and the largest of them are the ends of the scale."""
    finite = [each for each in course if math.isfinite(each)]
    if not finite:
        return ""
    low, high = min(finite), max(finite)
    scale = (len(_BLOCKS) - 1) / (high - low) if high > low else 0.0
    return "".join(
        _BLOCKS[round((each - low) * scale)] if math.isfinite(each) else " " for each in course
    )


def text_of(row: Row) -> str:
    """The last value of a signal as text, with its unit; empty if there was none."""
    value, unit = row.value, row.connector.unit
    if value is None:
        return ""
    if isinstance(value, bytes):
        if row.connector.mime_type.startswith("text/"):
            return _shortened(repr(value.decode(errors="replace")))
        return f"{len(value)} bytes"
    unit = "" if unit == "1" else f" {unit}"
    if value.ndim == 0:
        return f"{_scalar(value)}{unit}"
    shape = "x".join(map(str, value.shape))
    low, high = _extent(value)
    extent = "" if low is None else f"{low:.6g} to {high:.6g}{unit} "
    return f"{extent}({shape})"


def _scalar(value: Any) -> str:
    plain = value.item()
    return f"{plain:.6g}" if isinstance(plain, float) else _shortened(str(plain))


def _number(value: Signal) -> float | None:
    """A number that stands for a value; `None` if there is none."""
    if isinstance(value, bytes):
        return float(len(value))
    if value.dtype.kind not in "biuf" or value.size == 0:
        return None
    with np.errstate(all="ignore"):
        return float(value.mean())


def _extent(value: Any) -> tuple[float | None, float | None]:
    if value.dtype.kind not in "biuf" or value.size == 0:
        return None, None
    return float(value.min()), float(value.max())


def _summary(value: Signal | None) -> dict[str, Any]:
    if value is None:
        return {"value": None}
    if isinstance(value, bytes):
        return {"bytes": len(value)}
    if value.ndim == 0 and value.dtype.kind in "biufU":
        plain = value.item()
        return {"value": _finite(plain) if isinstance(plain, float) else plain}
    low, high = _extent(value)
    return {"shape": list(value.shape), "least": _finite(low), "largest": _finite(high)}


def _by_component(schema: Schema, values: Signal | None) -> Mapping[str, int]:
    if not isinstance(values, np.ndarray):
        return {}
    if values.shape != (len(schema.components),):
        raise WireError(f"{values.shape} values of {len(schema.components)} components")
    return dict(zip(schema.components, values.tolist(), strict=True))


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _brief(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"


def _age(value: float) -> str:
    return f"{value * 1e3:.4g} ms" if math.isfinite(value) else "-"


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_TEXT else f"{text[: _LONGEST_TEXT - 1]}…"
