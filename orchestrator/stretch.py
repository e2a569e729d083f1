"""What observers see of the points that the engine worked through."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from orchestrator.signal import Array, Signals
from orchestrator.timebase import Time

_NO_SIZES: Final[Array] = np.empty(0, np.int64)


class Rows(NamedTuple):
    """The samples of one signal, all of the same size.

    Attributes:
        data: of all samples, one after the other.
        sizes: of each sample of a Binary [byte], int64, shape (sample,); empty for arrays.
        shape: of each sample of an array.
    """

    data: bytes | memoryview
    sizes: Array = _NO_SIZES
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Samples:
    """What one component published.

    Attributes:
        times: when [ns], int64, shape (sample,); they never change.
        rows: the recorded signals, by connector. They last until the observers are done.
        are_kept: whether the rows of arrays last as long as somebody has them.
    """

    times: Array
    rows: Mapping[str, Rows]
    are_kept: bool = False


@dataclass(frozen=True, slots=True)
class Stretch:
    """Communication points that follow each other.

    Attributes:
        time: the last of them [ns].
        count: how many they are.
        samples: of the components that published, by name.
        values: the published outputs of all components at the last point.
    """

    time: Time
    count: int
    samples: Mapping[str, Samples]
    values: Mapping[str, Signals]
