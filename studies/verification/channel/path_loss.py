"""`pathloss.csv`: path loss of single links, by three models."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.table import Table, number, number_or_empty, read_table, text
from studies.verification.channel.tolerances import LOSS, Tolerance

NAME: Final = "pathloss.csv"

_PARAMETERS: Final[Mapping[str, Mapping[str, str]]] = {
    "simple": {"alpha": "path_loss_exponent"},
    "tworay": {"epsilon_r": "permittivity"},
    "breakpoint": {
        "L01_db": "breakpoint_near_loss",
        "L02_db": "breakpoint_far_loss",
        "alpha1": "path_loss_exponent",
        "alpha2": "breakpoint_far_exponent",
        "breakpoint_m": "breakpoint_distance",
    },
}
"""The columns of each model, and the parameters of the channel that they are."""
_CHOICE: Final = {"simple": "exponent", "tworay": "two_ray", "breakpoint": "breakpoint"}
_FREE: Final = sorted({column for columns in _PARAMETERS.values() for column in columns})
_TX: Final = ("tx_x", "tx_y", "tx_z")
_RX: Final = ("rx_x", "rx_y", "rx_z")


@dataclass(frozen=True, slots=True)
class _Group:
    """Rows that one instance of the channel can answer."""

    parameters: Mapping[str, Any]
    rows: list[int]


@dataclass(frozen=True, slots=True)
class PathLossCheck(Check):
    """The links of the file."""

    table: Table
    groups: tuple[_Group, ...]

    @property
    @override
    def tolerance(self) -> Tolerance:
        return LOSS

    @property
    @override
    def work(self) -> int:
        return len(self.groups)

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        table, ours = self.table, np.empty(len(self.table))
        tx, rx = (np.stack([table[c] for c in columns], axis=-1) for columns in (_TX, _RX))
        for group in self.groups:
            probes = scene.links(tx[group.rows], rx[group.rows])
            with channel.start(group.parameters, probes) as session:
                ours[group.rows] = session.probed("path_loss")
            progress.advance()
        return self._compared(ours, np.linalg.norm(tx - rx, axis=1))

    def _compared(self, ours: Array, distance: Array) -> Comparison:
        models = [model for model in _CHOICE if (self.table["model"] == model).any()]
        rows = {model: np.flatnonzero(self.table["model"] == model) for model in models}
        return Comparison.of_values(
            LOSS,
            [f"{NAME}:{row + 2}" for model in models for row in rows[model]],
            [
                Series(
                    label=model,
                    golden=self.table["loss_db"][rows[model]],
                    ours=ours[rows[model]],
                    x=distance[rows[model]],
                )
                for model in models
            ],
        )


def read(path: Path) -> PathLossCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    columns = {
        "model": text,
        **dict.fromkeys(("freq_hz", *_TX, *_RX, "loss_db"), number),
        **dict.fromkeys(_FREE, number_or_empty),
    }
    table = read_table(path, NAME, columns)
    rows: dict[tuple[tuple[str, Any], ...], list[int]] = defaultdict(list)
    for row in range(len(table)):
        rows[tuple(_parameters(table, row).items())].append(row)
    return PathLossCheck(table, tuple(_Group(dict(key), found) for key, found in rows.items()))


def _parameters(table: Table, row: int) -> dict[str, Any]:
    model = table["model"][row]
    if model not in _CHOICE:
        known = ", ".join(_CHOICE)
        raise table.problem(row, f"model: `{model}` is not known; there are: {known}")
    values = {name: float(table[column][row]) for column, name in _PARAMETERS[model].items()}
    for column, name in _PARAMETERS[model].items():
        if np.isnan(values[name]):
            raise table.problem(row, f"{column}: is empty, but `{model}` needs it")
    frequency = float(table["freq_hz"][row])
    return {
        "model": "veins",
        "carrier_frequency": frequency,
        "path_loss": _CHOICE[model],
        **values,
    }
