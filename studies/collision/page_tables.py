"""Tables of the page; empty text where there are no rows."""

import math
from collections.abc import Sequence
from pathlib import Path

from studies.collision import runs
from studies.collision.conditions import CONSTANT, USUAL_AGE, load_name, policy_key, policy_name
from studies.collision.curves import Assumption, CriticalPoint, CurveName, Linearity
from studies.collision.published import COOPERNAUT
from studies.collision.runs import EXPERIMENTS, SUFFIX
from studies.collision.statistics import Partner, Result
from studies.method.style import method_name
from studies.method.text import markdown, percent_shown, shown


def policies(rows: Sequence[Result]) -> str:
    """Driving policies under perfect communication beside COOPERNAUT's."""
    head = ("policy", "runs", "success [%]", "theirs", "SCT [%]", "theirs", "collisions [%]",
            "theirs")  # fmt: skip
    body = []
    for row in rows:
        theirs = COOPERNAUT.get(policy_key(row.policy, row.compression))
        published = (
            ("", "", "")
            if theirs is None
            else (
                f"{theirs.success:g} ± {theirs.success_sd:g}",
                f"{theirs.sct:g} ± {theirs.sct_sd:g}",
                f"{theirs.collisions:g} ± {theirs.collisions_sd:g} ({theirs.name})",
            )
        )
        ours = [percent_shown(each) for each in (row.success, row.sct, row.collision_rate)]
        pairs = [cell for pair in zip(ours, published, strict=True) for cell in pair]
        body.append([policy_name(row.policy, row.compression), str(row.runs), *pairs])
    return _table(head, body)


def critical(points: Sequence[CriticalPoint]) -> str:
    """Packet error rates at which curves cross levels."""
    levels = list(dict.fromkeys(point.level for point in points))
    head = ("curve", *(f"{100 * level:g} % collide, at PER [%]" for level in levels))
    found: dict[CurveName, dict[float, str]] = {}
    for point in points:
        found.setdefault(point.curve, {})[point.level] = _crossing(point)
    body = [
        [_curve(name), *(cells.get(level, "") for level in levels)] for name, cells in found.items()
    ]
    return _table(head, body)


def linearity(bends: Sequence[Linearity]) -> str:
    """How far curves are from straight lines."""
    head = ("curve", "deviation [points]", "at PER [%]", "band [points]", "p", "deviance, line",
            "deviance, logistic", "degrees of freedom")  # fmt: skip
    body = [
        [
            _curve(bend.curve),
            f"{100 * bend.deviation:+.1f}",
            f"{100 * bend.at:.0f}",
            f"± {100 * bend.band:.1f}",
            f"{bend.p:.4f}",
            f"{bend.deviance_line:.1f}",
            f"{bend.deviance_logistic:.1f}",
            str(bend.freedom),
        ]
        for bend in bends
    ]
    return _table(head, body)


def assumed(rows: Sequence[Assumption]) -> str:
    """The simulated channel against a constant rate of the same mean."""
    head = ("relay", "compression", "km/h", "dBm", "load", "PER [%]", "collisions [%]",
            "assumed [%]", "difference [points]")  # fmt: skip
    body = [
        [
            method_name(row.relay),
            _plain(row.compression),
            _plain(row.speed_kmh),
            _plain(row.transmit_power),
            load_name(row.load, row.granularity),
            *map(percent_shown, (row.per, row.rate, row.assumed, row.difference)),
        ]
        for row in rows
    ]
    return _table(head, body)


def loads(rows: Sequence[Result]) -> str:
    """Collisions under every load and loss granularity."""
    head = ("load", "relay", "runs", "PER [%]", "collisions [%]", "success [%]")
    body = [
        [
            load_name(row.load, row.granularity),
            method_name(row.relay),
            str(row.runs),
            *map(percent_shown, (row.packet_error_rate, row.collision_rate, row.success)),
        ]
        for row in rows
    ]
    return _table(head, body)


def radio(rows: Sequence[Result]) -> str:
    """Collisions with weaker radios."""
    head = ("relay", "dBm", "runs", "PER [%]", "first trigger [s]",
            "scans without a message [%]", "collisions [%]")  # fmt: skip
    body = []
    for row in rows:
        unserved = percent_shown(row.unserved)
        seen = [percent_shown(row.packet_error_rate), shown(row.begin, ".1f"), unserved]
        setting = [method_name(row.relay), _plain(row.transmit_power), str(row.runs)]
        body.append([*setting, *seen, percent_shown(row.collision_rate)])
    return _table(head, body)


def partners(rows: Sequence[Partner]) -> str:
    """The numbers of collisions by partner, over all conditions of an experiment."""
    whom = sorted({row.partner for row in rows})
    head = ("experiment", "policy", *whom)
    found: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        key = (row.experiment, policy_name(row.policy, row.compression))
        found.setdefault(key, {})[row.partner] = str(row.collisions)
    return _table(head, [[*key, *(n.get(each, "0") for each in whom)] for key, n in found.items()])


def conditions(rows: Sequence[Result]) -> str:
    """Every condition of every experiment."""
    head = ("experiment", "policy", "uses [s]", "relay", "km/h", "channel", "dBm", "load",
            "PER [%]", "runs", "collisions [%]", "success [%]", "completion [s]")  # fmt: skip
    body = [
        [
            row.experiment,
            policy_name(row.policy, row.compression),
            "" if row.maximum_age is None else str(row.maximum_age),
            method_name(row.relay),
            _plain(row.speed_kmh),
            row.channel,
            _plain(row.transmit_power),
            load_name(row.load, row.granularity),
            _per(row),
            str(row.runs),
            percent_shown(row.collision_rate),
            percent_shown(row.success),
            shown(row.completion_time, ".1f"),
        ]
        for row in rows
    ]
    return _table(head, body)


def costs(folder: Path) -> str:
    """What every experiment cost."""
    body = []
    for name in EXPERIMENTS:
        if not (folder / f"{name}{SUFFIX}").is_file():
            continue
        times = [row.wall_s for row in runs.read(folder, name) if row.error is None]
        if times:
            each = f"{math.fsum(times) / len(times):.2f}"
            body.append([name, str(len(times)), f"{math.fsum(times) / 3600:.2f}", each])
    return _table(("experiment", "runs", "time of workers [h]", "per run [s]"), body)


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    return markdown(head, body) if body else ""


def _per(row: Result) -> str:
    """What is set, or what was measured with its interval."""
    if row.channel == CONSTANT:
        return _plain(None if row.per is None else 100 * row.per)
    return percent_shown(row.packet_error_rate)


def _curve(name: CurveName) -> str:
    text = f"{name.channel}, compression {name.compression}, {_plain(name.speed_kmh)} km/h"
    age = name.maximum_age
    return text if age in (None, USUAL_AGE) else f"{text}, scans of the last {age:g} s"


def _plain(number: float | None) -> str:
    return "" if number is None else f"{number:g}"


def _crossing(point: CriticalPoint) -> str:
    """A packet error rate in percent with its interval; bounds beyond the curve are named."""
    found = point.per
    each = (None, None, None) if found is None else (found.value, found.low, found.high)
    middle, low, high = (_bounded(per, 100 * point.first, 100 * point.last) for per in each)
    return f"{middle} [{low}, {high}]"


def _bounded(per: float | None, first: float, last: float) -> str:
    """A packet error rate in percent on a curve from `first` to `last`, both in percent."""
    if per is None:
        return "-"
    if math.isinf(per):
        return f"below {first:.1f}" if per < 0 else f"above {last:.1f}"
    return f"{100 * per:.1f}"
