"""Which figure of the manual is drawn from which table, and how."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, TypeAlias

import yaml

from studies.collision import figures as collision
from studies.collision.report import FIGURE
from studies.collision.runs import CONSTANT_PER, LOAD, POLICIES, RADIO
from studies.collision.statistics import Result, beside_relay
from studies.lasting import report as lasting
from studies.lasting.decisions import Dose
from studies.lasting.figures import draw_doses
from studies.method import records
from studies.relay import figures as relay, heat_map
from studies.relay.advantage import Cell, Map
from studies.relay.statistics import DensityPoint, Step
from studies.sharing.page import draw as draw_sharing
from studies.training import figure as training
from studies.training.results import read as read_training
from studies.verification.channel import figures as channel, shown as channel_data
from studies.verification.drawing import write
from studies.verification.perception import figures as perception, shown as perception_data

Draw: TypeAlias = Callable[[Path], None]
"""Draws one or some figures from the tables in a folder, into it."""

_MAPS: Final = ("relay_map_budget", "relay_map_load")
_EXPERIMENTS: Final = Path(relay.__file__).parent / "experiments"


def catalogue(docs: Path) -> Mapping[str, Draw]:
    """All figures that have tables in `docs`, by the place of the files there, without suffix.

    What draws several at once stands under the folder of them. Each takes the folder.
    """
    found = dict(_studies())
    for path in sorted((docs / "results" / "training").glob("*-training.csv")):
        name = path.name.removesuffix(".csv")
        found[f"results/training/{name}"] = partial(_draw_training, name=name)
    return {
        **found,
        "validation": _draw_channel,
        "validation-perception": _draw_perception,
    }


def folder_of(docs: Path, name: str) -> Path:
    """The folder of the tables and pictures of a figure."""
    place = docs / name
    return place if place.is_dir() else place.parent


def _studies() -> Iterator[tuple[str, Draw]]:
    yield (
        "results/figure7",
        lambda at: relay.draw_density(
            records.read(at / "figure7.csv", DensityPoint), at / "figure7"
        ),
    )
    yield (
        "results/figure8",
        lambda at: relay.draw_distribution(records.read(at / "figure8.csv", Step), at / "figure8"),
    )
    for name in _MAPS:
        yield f"results/{name}", partial(_draw_map, name=name)
    for name in (FIGURE, lasting.FIGURE):
        yield f"results/{name}", partial(_draw_over_per, name=name)
    yield (
        f"results/{POLICIES}",
        lambda at: collision.draw_policies(
            [row for row in _collisions(at) if row.experiment == POLICIES], at / POLICIES
        ),
    )
    yield (
        f"results/{RADIO}",
        lambda at: collision.draw_radio(
            beside_relay(_collisions(at), RADIO),
            [row for row in _collisions(at) if row.experiment == CONSTANT_PER],
            at / RADIO,
        ),
    )
    yield (
        f"results/{LOAD}",
        lambda at: collision.draw_load(beside_relay(_collisions(at), LOAD), at / LOAD),
    )
    yield (
        f"results/{lasting.DOSES}",
        lambda at: draw_doses(records.read(at / f"{lasting.DOSES}.csv", Dose), at / lasting.DOSES),
    )
    yield "results/apmm", draw_sharing


def _collisions(folder: Path) -> list[Result]:
    return records.read(folder / "collision.csv", Result)


def _draw_over_per(folder: Path, name: str) -> None:
    collision.draw_over_per(records.read(folder / f"{name}.csv", Result), folder / name)


def _draw_map(folder: Path, name: str) -> None:
    """Draw a map; what is compared, its experiment says."""
    experiment = yaml.safe_load((_EXPERIMENTS / f"{name}.yaml").read_text(encoding="utf-8"))
    asked = Map(**experiment["report"]["parameters"]["map"])
    heat_map.draw(records.read(folder / f"{name}.csv", Cell), asked, folder / name)


def _draw_training(folder: Path, name: str) -> None:
    """Draw a training; the manual has it as SVG only."""
    found = read_training(folder, f"{name.removesuffix('training')}")
    with TemporaryDirectory() as draft:
        training.draw(found, Path(draft))
        (folder / f"{name}.svg").write_bytes((Path(draft) / "training.svg").read_bytes())


def _draw_channel(folder: Path) -> None:
    write(channel.drawings(channel_data.Shown.read(folder)), folder)


def _draw_perception(folder: Path) -> None:
    write(perception.drawings(perception_data.Shown.read(folder)), folder)
