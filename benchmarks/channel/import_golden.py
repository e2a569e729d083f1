"""Makes the committed inputs of the benchmark from the recorded runs of Veins.

Use: `python -m benchmarks.channel.import_golden DIR`. DIR holds `cost.json`
and `stack/<run>/{positions.csv.gz, vehicles.csv, buildings.json}`: what Veins' vehicles did, and
what it cost. Positions are rounded to millimetres.
"""

import argparse
import csv
import gzip
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.channel.layout import DATA, Float, Layout

RUNS: Final = {"cross44": "cross44_obstacles", "grid200": "grid200_obstacles_jitter"}
"""The recorded run of each workload."""


def read_run(folder: Path) -> Layout:
    """The layout of one recorded run."""
    with (folder / "vehicles.csv").open(encoding="utf-8", newline="") as file:
        vehicles = list(csv.DictReader(file))
    front, heading = _motion(folder, [row["veh"] for row in vehicles])
    buildings = json.loads((folder / "buildings.json").read_text(encoding="utf-8"))["buildings"]
    rings = [np.array(building["shape_sumo"], float) for building in buildings]
    return Layout(
        front=front,
        heading=heading,
        size=np.array([[float(row[k]) for k in ("length", "width", "height")] for row in vehicles]),
        vertex=np.concatenate(rings),
        index=np.repeat(np.arange(len(rings), dtype=np.int32), [len(ring) for ring in rings]),
    )


def _motion(folder: Path, names: Sequence[str]) -> tuple[Float, Float]:
    """Front bumpers [m] and headings [rad], in the frame of SUMO.

    Raises:
        ValueError: a vehicle is missing at some time.
    """
    with gzip.open(folder / "positions.csv.gz", "rt", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    times = {t: k for k, t in enumerate(sorted({float(row["t_veins"]) for row in rows}))}
    place = {name: k for k, name in enumerate(names)}
    front = np.full((len(times), len(names), 2), np.nan)
    heading = np.full(front.shape[:2], np.nan)
    for row in rows:
        at = times[float(row["t_veins"])], place[row["veh"]]
        front[at] = float(row["sumo_x"]), float(row["sumo_y"])
        heading[at] = np.radians(90.0 - float(row["sumo_angle_deg"]))
    if np.isnan(front).any():
        raise ValueError(f"{folder}: not every vehicle is there all the time")
    return front, heading


def import_golden(source: Path, target: Path) -> None:
    """Write the layouts and Veins' figures."""
    target.mkdir(parents=True, exist_ok=True)
    for name, run in RUNS.items():
        read_run(source / "stack" / run).write(target / f"{name}.npz")
    cost: Mapping[str, object] = json.loads((source / "cost.json").read_text(encoding="utf-8"))
    text = json.dumps(cost, indent=1, ensure_ascii=False)
    (target / "veins.json").write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Read the arguments and do it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("source", type=Path, metavar="DIR", help="the recorded runs")
    import_golden(parser.parse_args().source, DATA)


if __name__ == "__main__":
    main()
