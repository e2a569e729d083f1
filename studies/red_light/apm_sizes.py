"""How long APM messages are: `python -m studies.red_light.apm_sizes RUN [RUN ...]`.

Each RUN is a directory of `nlosim run` with the signal `perception.apms`, in either form. Prints a
row of a table (Markdown) for each.
"""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from fmus.messages.apm import Apm, decode, encode, split
from orchestrator.recording import Recording
from orchestrator.tables import CLOSE, left, markdown

PACKET: Final = 1400
"""Most bytes of a message in one packet; the facilities' default `fragment_size`."""

COLUMNS: Final = left(
    "matrix",
    "plain, cells only",
    "plain with layer",
    "compressed, cells only: median, max",
    "compressed with layer: median, max",
    "packets, plain to compressed",
)


def recorded(recording: Recording) -> list[Apm]:
    """Every APM of a run, once."""
    messages = {
        message for signal in recording["perception.apms"] for message in split(bytes(signal))
    }
    return [decode(message) for message in sorted(messages)]


def row(apms: Sequence[Apm]) -> list[str]:
    """The cells of matrices of equal size that have a layer.

    Raises:
        ValueError: there are none, or they differ in size or levels, or one has no layer.
    """
    shapes = {(*apm.cells.shape, apm.levels) for apm in apms}
    if len(shapes) != 1 or any(apm.layer is None for apm in apms):
        raise ValueError(f"the APMs of a run must be of one size and have layers: {shapes}")
    bare = [replace(apm, layer=None) for apm in apms]
    plain = [len(encode(of[0])) for of in (bare, apms)]
    short = [_sizes(of) for of in (bare, apms)]
    (rows, columns, levels), counts = shapes.pop(), [_packets(plain[1]), _packets(max(short[1]))]
    index = f", {levels} levels" if levels else ""
    spread = [f"{np.median(sizes):.0f}, {max(sizes)}" for sizes in short]
    sizes = [str(size) for size in plain]
    return [f"{rows} x {columns}{index}", *sizes, *spread, f"{counts[0]} to {counts[1]}"]


def _sizes(apms: Iterable[Apm]) -> list[int]:
    """Bytes of each compressed message."""
    return [len(encode(apm, compressed=True)) for apm in apms]


def _packets(size: int) -> int:
    """Packets of a message of `size` bytes."""
    return -(-size // PACKET)


def main(runs: Sequence[str]) -> None:
    """The command line."""
    rows = [row(recorded(Recording(Path(run)))) for run in runs]
    sys.stdout.write("\n".join(markdown(COLUMNS, rows, CLOSE)) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
