"""Tables of the page; empty text where there are no rows."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from studies.collision.campaign import EXPERIMENTS
from studies.collision.condition import USUAL_AGE
from studies.collision.names import policy_key, policy_name, relay_name
from studies.collision.published import COOPERNAUT
from studies.collision.runs import SUFFIX
from studies.method import csv_file
from studies.method.page import numbers
from studies.method.text import interval, markdown

Row = Mapping[str, str]
Rows = Sequence[Row]
Numbers = Mapping[str, float | None]

_NONE: Final = ""


def policies(rows: Rows) -> str:
    """Driving policies under perfect communication beside COOPERNAUT's."""
    head = ("policy", "runs", "success [%]", "theirs", "SCT [%]", "theirs", "collisions [%]",
            "theirs")  # fmt: skip
    body = []
    for row in rows:
        values, theirs = numbers(row), COOPERNAUT.get(policy_key(row))
        published = (
            ("", "", "")
            if theirs is None
            else (
                f"{theirs.success:g} ± {theirs.success_sd:g}",
                f"{theirs.sct:g} ± {theirs.sct_sd:g}",
                f"{theirs.collisions:g} ± {theirs.collisions_sd:g} ({theirs.name})",
            )
        )
        ours = (_percent(values, "success"), _percent(values, "sct"), _rate(values))
        pairs = [cell for pair in zip(ours, published, strict=True) for cell in pair]
        body.append([policy_name(row), row["runs"], *pairs])
    return _table(head, body)


def critical(rows: Rows) -> str:
    """Packet error rates at which curves cross levels."""
    levels = list(dict.fromkeys(row["level"] for row in rows))
    head = ("curve", *(f"{100 * float(level):g} % collide, at PER [%]" for level in levels))
    found: dict[str, dict[str, str]] = {}
    for row in rows:
        found.setdefault(_curve(row), {})[row["level"]] = _crossing(numbers(row))
    body = [[name, *(cells.get(level, _NONE) for level in levels)] for name, cells in found.items()]
    return _table(head, body)


def linearity(rows: Rows) -> str:
    """How far curves are from straight lines."""
    head = ("curve", "deviation [points]", "at PER [%]", "band [points]", "p", "deviance, line",
            "deviance, logistic", "degrees of freedom")  # fmt: skip
    body = []
    for row in rows:
        value = {name: number or 0.0 for name, number in numbers(row).items()}
        body.append(
            [
                _curve(row),
                f"{100 * value['deviation']:+.1f}",
                f"{100 * value['at']:.0f}",
                f"± {100 * value['band']:.1f}",
                f"{value['p']:.4f}",
                f"{value['deviance_line']:.1f}",
                f"{value['deviance_logistic']:.1f}",
                row["freedom"],
            ]
        )
    return _table(head, body)


def assumed(rows: Rows) -> str:
    """The simulated channel against a constant rate of the same mean."""
    head = ("relay", "compression", "km/h", "dBm", "load", "PER [%]", "collisions [%]",
            "assumed [%]", "difference [points]")  # fmt: skip
    body = [
        [
            relay_name(row["relay"]),
            row["compression"],
            _plain(row["speed_kmh"]),
            _plain(row["transmit_power"]),
            _load(row),
            *(_percent(numbers(row), name) for name in ("per", "rate", "assumed", "difference")),
        ]
        for row in rows
    ]
    return _table(head, body)


def loads(rows: Rows) -> str:
    """Collisions under every load and loss granularity."""
    head = ("load", "relay", "runs", "PER [%]", "collisions [%]", "success [%]")
    body = [
        [
            _load(row),
            relay_name(row["relay"]),
            row["runs"],
            _percent(numbers(row), "per"),
            _rate(numbers(row)),
            _percent(numbers(row), "success"),
        ]
        for row in rows
    ]
    return _table(head, body)


def radio(rows: Rows) -> str:
    """Collisions with weaker radios."""
    head = ("relay", "dBm", "runs", "PER [%]", "first trigger [s]",
            "scans without a message [%]", "collisions [%]")  # fmt: skip
    body = [
        [
            relay_name(row["relay"]),
            _plain(row["transmit_power"]),
            row["runs"],
            _percent(numbers(row), "per"),
            interval(numbers(row), "begin", ".1f"),
            _percent(numbers(row), "unserved"),
            _rate(numbers(row)),
        ]
        for row in rows
    ]
    return _table(head, body)


def partners(rows: Rows) -> str:
    """With whom the ego collided, over all conditions of an experiment."""
    whom = sorted({row["partner"] for row in rows})
    head = ("experiment", "policy", *whom)
    found: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        key = (row["experiment"], policy_name(row))
        found.setdefault(key, {})[row["partner"]] = row["collisions"]
    return _table(head, [[*key, *(n.get(each, "0") for each in whom)] for key, n in found.items()])


def conditions(rows: Rows) -> str:
    """Every condition of every experiment."""
    head = ("experiment", "policy", "uses [s]", "relay", "km/h", "channel", "dBm", "load",
            "PER [%]", "runs", "collisions [%]", "success [%]", "completion [s]")  # fmt: skip
    body = [
        [
            row["experiment"],
            policy_name(row),
            row["maximum_age"],
            relay_name(row["relay"]),
            _plain(row["speed_kmh"]),
            row["channel"],
            _plain(row["transmit_power"]),
            _load(row),
            _per(row),
            row["runs"],
            _rate(numbers(row)),
            _percent(numbers(row), "success"),
            interval(numbers(row), "completion_time", ".1f"),
        ]
        for row in rows
    ]
    return _table(head, body)


def costs(folder: Path) -> str:
    """What every experiment cost."""
    body = []
    for name in EXPERIMENTS:
        path = folder / f"{name}{SUFFIX}"
        if not path.is_file():
            continue
        times = [float(row["wall_s"]) for row in csv_file.read(path) if not row["error"]]
        if times:
            each = f"{math.fsum(times) / len(times):.2f}"
            body.append([name, str(len(times)), f"{math.fsum(times) / 3600:.2f}", each])
    return _table(("experiment", "runs", "time of workers [h]", "per run [s]"), body)


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    return markdown(head, body) if body else ""


def _percent(values: Numbers, name: str) -> str:
    return interval(values, name, ".1f", scale=100.0)


def _rate(values: Numbers) -> str:
    bounds = {"rate_low": values["low"], "rate_high": values["high"]}
    return _percent({**values, **bounds}, "rate")


def _per(row: Row) -> str:
    """What is set, or what was measured with its interval."""
    if row["channel"] == "constant":
        return _plain(str(100 * float(row["per"])))
    return _percent(numbers(row), "per")


def _curve(row: Row) -> str:
    name = f"{row['channel']}, compression {row['compression']}, {_plain(row['speed_kmh'])} km/h"
    age = float(row["maximum_age"])
    return name if age == USUAL_AGE else f"{name}, scans of the last {age:g} s"


def _load(row: Row) -> str:
    return ", ".join(filter(None, (row["load"], row["granularity"])))


def _plain(number: str) -> str:
    return f"{float(number):g}" if number else _NONE


def _crossing(values: Numbers) -> str:
    """A packet error rate in percent with its interval; bounds beyond the curve are named."""
    first, last = (100 * (values[name] or 0.0) for name in ("first", "last"))
    shown = [_bounded(values[name], first, last) for name in ("per", "per_low", "per_high")]
    return f"{shown[0]} [{shown[1]}, {shown[2]}]"


def _bounded(per: float | None, first: float, last: float) -> str:
    if per is None:
        return "-"
    if math.isinf(per):
        return f"below {first:.1f}" if per < 0 else f"above {last:.1f}"
    return f"{100 * per:.1f}"
