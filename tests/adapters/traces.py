"""Traffic in files, and what the replay component makes of it."""

import gzip
import importlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from adapters.replay import FcdReplay
from orchestrator.parameters import PythonComponentType
from orchestrator.signal import Array, Signals
from orchestrator.timebase import nanoseconds

COLUMNS = ("id", "time", "x", "y", "heading", "speed", "type")


@dataclass(frozen=True, kw_only=True)
class Sample:
    """A row of a table: degrees clockwise from north, the middle of the front bumper."""

    id: str
    time: float
    x: float = 0.0
    y: float = 0.0
    heading: float = 90.0
    speed: float = 10.0
    type: str = "passenger"


def write_csv(path: Path, samples: Sequence[Sample], delimiter: str = ",") -> Path:
    rows = [[str(getattr(sample, column)) for column in COLUMNS] for sample in samples]
    path.write_text("\n".join(delimiter.join(row) for row in [COLUMNS, *rows]) + "\n")
    return path


def write_parquet(path: Path, samples: Sequence[Sample]) -> Path:
    pyarrow, parquet = map(importlib.import_module, ("pyarrow", "pyarrow.parquet"))
    columns = {column: [getattr(sample, column) for sample in samples] for column in COLUMNS}
    parquet.write_table(pyarrow.table(columns), path, row_group_size=3)
    return path


def write_fcd(path: Path, samples: Sequence[Sample]) -> Path:
    lines = ["<fcd-export>"]
    for time, those in groupby(samples, key=attrgetter("time")):
        lines.append(f'<timestep time="{time}">')
        lines += [
            f'<vehicle id="{s.id}" x="{s.x}" y="{s.y}" angle="{s.heading}" speed="{s.speed}" '
            f'type="{s.type}" pos="1.00" lane="a_0" slope="0.00"/>'
            for s in those
        ]
        lines.append("</timestep>")
    text = "\n".join([*lines, "</fcd-export>", ""])
    if path.suffix == ".gz":
        path.write_bytes(gzip.compress(text.encode()))
    else:
        path.write_text(text)
    return path


def replay(file: Path, **parameters: Any) -> FcdReplay:
    """As a scenario makes it: what is not said has its default."""
    component = PythonComponentType(FcdReplay).create("traffic", {"file": file, **parameters})
    assert isinstance(component, FcdReplay)
    return component


def states(
    component: FcdReplay, step: str, count: int, start: str = "0", seed: int = 1
) -> Iterator[Signals]:
    """The outputs at `count` + 1 communication points."""
    t, h = nanoseconds(start), nanoseconds(step)
    component.setup(t, np.random.default_rng(seed))
    component.initialise({})
    yield component.outputs()
    for k in range(count):
        component.step({}, t + k * h, h)
        yield component.outputs()
    component.close()


def array(signals: Signals, name: str) -> Array:
    return np.asarray(signals[f"vehicle.{name}"])


def entered(signals: Signals) -> list[tuple[int, str, str]]:
    value = signals["entered"]
    assert isinstance(value, bytes)
    return [(number, name, kind) for number, name, kind in json.loads(value)]
