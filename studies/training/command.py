"""`nlosim train`, found by the entry point group `orchestrator.commands`."""

import argparse
from pathlib import Path
from typing import Any

from orchestrator.cli.command import command, seed
from orchestrator.cli.outcome import Outcome

_EPILOG = """\
First the expert drives and the network learns what it did (behaviour cloning). Then the network
drives, now and then corrected by the expert, and learns what the expert would have done where
it came to (DAgger); that is one round, and there are several. Each round ends when the loss in
scenes that are never learned from has stopped falling.

The directory holds training.csv (a row per epoch), phases.csv (how the drives went), training.svg
and .png (both of these drawn), summary.txt, log.txt, provenance.json, and what it takes to go on.
What is finished when Ctrl-C comes is kept; --resume goes on with the next run or epoch, to the same
network on the same machine. A run that fails is tried again, then left out and reported; if more
than a tenth of a phase fails, the training ends. See docs/training.md.

examples:
  nlosim train studies/training/recipes/bev_32.yaml
  nlosim train studies/training/recipes/bev_32.yaml --out runs/bev --resume
  nlosim train studies/training/recipes/bev_32.yaml --seed 8 --checkpoint again.safetensors
  nlosim train studies/training/recipes/general_32.yaml --seeds 1..3 --out runs/general"""


def add_command(commands: Any) -> None:
    """Add `train` to the subparsers of the command line."""
    summary = "train a driving policy in the co-simulation"
    train = command(commands, "train", summary, _EPILOG, execute=execute)
    train.add_argument("training", metavar="FILE", type=Path, help="a training file (YAML)")
    train.add_argument(
        "--out",
        metavar="DIR",
        help="the directory of the results (default: runs/train-FILE, numbered if it exists)",
    )
    train.add_argument("--resume", action="store_true", help="go on with what is in --out")
    train.add_argument("--seed", type=seed, metavar="N", help="instead of the file's seed")
    train.add_argument(
        "--seeds",
        metavar="LIST",
        help="several trainings one after the other, e.g. 1..3, in folders seed-N of --out; the "
        "network of the first goes where the file says",
    )
    train.add_argument(
        "--cache",
        metavar="DIR",
        help="where the expert's runs are kept: trainings with the same ones drive them once",
    )
    train.add_argument(
        "--checkpoint", metavar="FILE", help="instead of the file's: where the network goes"
    )
    train.add_argument(
        "--device", choices=("auto", "cpu", "cuda"), help="instead of the file's: where to learn"
    )
    train.add_argument(
        "--workers", type=int, metavar="N", help="processes that drive (default: one per core)"
    )
    train.add_argument("--quiet", action="store_true", help="no progress bars")


def execute(arguments: argparse.Namespace) -> Outcome:
    """Load, check, train."""
    from studies.training import train  # noqa: PLC0415 - much to import

    return train.execute(arguments)
