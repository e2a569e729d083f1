"""`pairs.csv`: totals of each ordered pair of vehicles over the whole run.

Under given transmit times the classes U, T and B and the decoded frames of every pair are
determined, also in the part of the run whose single events are not recorded.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from studies.verification.channel.table import read_table, text, whole

NAME: Final = "pairs.csv"
_CLASSES: Final = {
    "decoded": ("received", "lost_noise", "lost_interference"),
    "B": ("lost_rx_locked_on_other",),
    "T": ("lost_rx_transmitting",),
    "U": ("below_min_power",),
}
"""The columns of each class."""
_LETTERS: Final = {"decoded": "RNC", "B": "B", "T": "T", "U": "U"}


@dataclass(frozen=True, slots=True)
class PairTotals:
    """How many frames of each class arrived, by pair.

    Attributes:
        pair: transmitters and receivers, shape (pair, 2).
        classes: by class, shape (pair,).
    """

    pair: Array
    classes: dict[str, Array]

    def differences(self, name: str, names: tuple[str, ...], received: Array) -> list[str]:
        """A sentence for each pair and class whose total is not that of the RECEPTION records."""
        found = []
        for label, golden in self.classes.items():
            outcomes = [OUTCOMES.index(letter) for letter in _LETTERS[label]]
            of_class = received[np.isin(received["outcome"], outcomes)]
            counts = np.zeros((len(names), len(names)), np.int64)
            np.add.at(counts, (of_class["transmitter"], of_class["receiver"]), 1)
            ours = counts[self.pair[:, 0], self.pair[:, 1]]
            found += [
                f"{name}/{NAME}: {names[self.pair[k, 0]]} to {names[self.pair[k, 1]]}: golden "
                f"{golden[k]} of class {label}, ours {ours[k]}"
                for k in np.flatnonzero(golden != ours)
            ]
        return found


def read_pair_totals(folder: Path, name: str, numbers: dict[str, int]) -> PairTotals | None:
    """The totals in the folder of a run, if it has them.

    Raises:
        GoldenError: the file is malformed.
    """
    if not (folder / NAME).exists():
        return None
    columns = {"tx": text, "rx": text}
    counts = dict.fromkeys((c for group in _CLASSES.values() for c in group), whole)
    table = read_table(folder / NAME, f"{name}/{NAME}", {**columns, **counts})
    ends = [table.numbers_of(end, numbers) for end in ("tx", "rx")]
    classes = {
        label: np.sum([table[column] for column in group], axis=0)
        for label, group in _CLASSES.items()
    }
    return PairTotals(np.stack(ends, axis=-1), classes)
