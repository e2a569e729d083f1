"""Which names a pattern means."""

from collections.abc import Iterable
from fnmatch import fnmatchcase


def meant(pattern: str, names: Iterable[str]) -> list[str]:
    """The names that `pattern` means, in their order.

    A name means itself alone: `x[1]`, as tools call an element of an array, is no `x1`. Everything
    else is a pattern, in which `*` and `?` stand for any letters, and `[...]` for one of these.
    """
    offered = list(names)
    if pattern in offered:
        return [pattern]
    return [name for name in offered if fnmatchcase(name, pattern)]
