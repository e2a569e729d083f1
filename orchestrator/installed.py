"""What installed packages offer in their entry points.

Reading them takes longer than all else when a scenario is loaded; they are the same as long as
Python looks for packages in the same places.
"""

import importlib.metadata
import sys
from functools import lru_cache
from importlib.metadata import EntryPoints


def entry_points(group: str) -> EntryPoints:
    """The entry points of all installed packages in `group`."""
    return _found(group, tuple(sys.path))


@lru_cache
def _found(group: str, path: tuple[str, ...]) -> EntryPoints:
    """Those in `group` of the packages on `path`, which is `sys.path`."""
    del path
    return importlib.metadata.entry_points(group=group)
