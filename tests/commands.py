"""Commands as the command line executes them."""

import argparse
from collections.abc import Callable
from typing import Any

from orchestrator.cli.outcome import Outcome


def executed(add: Callable[[Any], None], *words: str) -> Outcome:
    """The outcome of the command that `add` adds to subparsers, called with these words."""
    parser = argparse.ArgumentParser()
    add(parser.add_subparsers())
    arguments = parser.parse_args(words)
    outcome: Outcome = arguments.execute(arguments)
    return outcome
