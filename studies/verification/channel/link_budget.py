"""`pathloss.csv` and `antenna_gain.json`: single links with nothing in between."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.signal import Array
from studies.verification.channel.check import Case, ProbedLinks, ValueCheck
from studies.verification.channel.golden_files import (
    Node,
    Table,
    number,
    number_or_empty,
    read_json,
    read_table,
    text,
)
from studies.verification.channel.session import (
    VEINS_ANTENNA_HEIGHT,
    link_inputs,
    vehicle_inputs,
)
from studies.verification.channel.tolerances import LOSS

PATH_LOSS: Final = "pathloss.csv"
ANTENNA: Final = "antenna_gain.json"

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
_SIZE: Final = (4.0, 2.0, 1.5)
"""Length, width and height of the vehicles that carry antennas [m]."""


def read_path_loss(path: Path) -> ValueCheck:
    """Read path losses by three models; one instance answers all links with equal parameters.

    Raises:
        GoldenError: the file is malformed.
    """
    columns = {
        "model": text,
        **dict.fromkeys(("freq_hz", *_TX, *_RX, "loss_db"), number),
        **dict.fromkeys(_FREE, number_or_empty),
    }
    table = read_table(path, PATH_LOSS, columns)
    tx, rx = (np.stack([table[c] for c in ends], axis=-1) for ends in (_TX, _RX))
    groups: dict[tuple[tuple[str, Any], ...], list[int]] = defaultdict(list)
    for row in range(len(table)):
        groups[tuple(_parameters(table, row).items())].append(row)
    order = [row for model in _CHOICE for row in np.flatnonzero(table["model"] == model).tolist()]
    place = np.argsort(order)  # of each row among the cases
    return ValueCheck(
        tolerance=LOSS,
        cases=[
            Case(place=table.place(row), golden=table["loss_db"][row], series=table["model"][row])
            for row in order
        ],
        questions=[
            ProbedLinks(
                cases=place[rows].tolist(),
                probe="path_loss",
                parameters=dict(parameters),
                inputs=link_inputs(tx[rows], rx[rows]),
            )
            for parameters, rows in groups.items()
        ],
    )


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
    return {"carrier_frequency": frequency, "path_loss": _CHOICE[model], **values}


def read_antenna(path: Path) -> ValueCheck:
    """Read gains of sampled antenna patterns in a direction; one instance for each direction.

    The channel gives the gain of both ends of a link, with one pattern for all. The other end is
    turned so that its sample at azimuth 0 points along the link; that sample is taken off.

    Raises:
        GoldenError: the file is malformed.
    """
    cases, questions = [], []
    for k, node in enumerate(read_json(path, ANTENNA).filled()):
        inputs = _direction(node)
        gains = tuple(node["gains_db"].numbers())
        if not gains:
            raise node["gains_db"].problem("must not be empty")
        golden = node["gain_db"].number()
        cases.append(
            Case(place=node.case, golden=golden, series="azimuth patterns", offset=-gains[0])
        )
        pattern = {"n_antenna_gain": len(gains), "antenna.gain": gains}
        questions.append(
            ProbedLinks(cases=[k], probe="antenna_gain", parameters=pattern, inputs=inputs)
        )
    return ValueCheck(tolerance=LOSS, cases=cases, questions=questions)


def _direction(node: Node) -> Mapping[str, Array]:
    """The own vehicle as it is turned, the other one turned towards it, and the link of both."""
    own, other = (np.array(node[name].numbers(2)) for name in ("own", "other"))
    towards = np.array(node["orientation"].numbers(2))
    if not towards.any() or (own == other).all():
        raise node.problem("the direction has no length")
    back = own - other
    heading = [np.arctan2(towards[1], towards[0]), np.arctan2(back[1], back[0])]
    height = VEINS_ANTENNA_HEIGHT
    bodies = vehicle_inputs([0, 1], [own, other], heading, [_SIZE, _SIZE])
    return {**bodies, **link_inputs([*own, height], [*other, height], [0, 1])}
