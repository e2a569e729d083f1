"""`nlosim verify`, found by the entry point group `orchestrator.commands`.

Each unit that can be verified adds its own parser through the entry points of `VERIFICATIONS`.
"""

import logging
from importlib.metadata import entry_points
from typing import Any, Final

logger = logging.getLogger(__name__)

VERIFICATIONS: Final = "orchestrator.verifications"
"""Entry points by the name of the unit: a callable that adds the unit's parser to the subparsers of
`verify`, with the default `execute`, a callable from the parsed arguments to an `Outcome`."""


def add_command(commands: Any) -> None:
    """Add `verify` to the subparsers of the command line."""
    verify = commands.add_parser("verify", help="compare a unit with data or theory from elsewhere")
    units = verify.add_subparsers(dest="unit", required=True, metavar="UNIT")
    for entry in sorted(entry_points(group=VERIFICATIONS), key=lambda entry: entry.name):
        try:
            entry.load()(units)
        except Exception as error:  # a broken one must not take the others away
            logger.warning("`verify %s` (%s) cannot be loaded: %s", entry.name, entry.value, error)
