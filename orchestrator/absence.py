"""What it means for a component that nothing drives one of its inputs.

Only the standard library is imported here: native units say it, too, while they are built.
"""

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass


class Need(enum.Enum):
    """When it is an error that nothing drives an input."""

    ALWAYS = "always"
    """Nobody could mean what the component does without it."""

    IF_OFFERED = "if offered"
    """Where another component of the scenario has an output for it; elsewhere it may be absent."""

    NEVER = "never"
    """It may be absent."""


@dataclass(frozen=True, slots=True)
class Undriven:
    """What it means for a component that nothing drives an input.

    Attributes:
        meaning: what comes of it, for people: the end of "nothing drives it: ...".
        need: when that is an error.
        beside: inputs of the same component; where one of them is driven, it is an error, too, if
            another component has an output for it, even if several have.
    """

    meaning: str
    need: Need = Need.ALWAYS
    beside: frozenset[str] = frozenset()


def said_of(names: Iterable[str], meanings: Mapping[str, Undriven]) -> dict[str, Undriven]:
    """What is said of each of these inputs; those of which nothing is said are left out.

    Args:
        names: of inputs.
        meanings: by the name of an input, or of a group: `vehicle` is for all beneath it. The
            longest name counts.

    Raises:
        ValueError: a name in `meanings` is none of the inputs, and no group of any.
    """
    found: dict[str, Undriven] = {}
    used: set[str] = set()
    for name in names:
        parts = name.split(".")
        ways = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
        key = next((way for way in ways if way in meanings), None)
        if key is not None:
            found[name] = meanings[key]
            used.add(key)
    if unknown := [name for name in meanings if name not in used]:
        raise ValueError(f"there is no input `{unknown[0]}`, nor one beneath it")
    return found
