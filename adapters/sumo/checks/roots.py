"""What a file is, by the name of its root element."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

_NET_SOURCES: Final = ("nodes", "edges", "connections", "types")

_WHAT_IT_IS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "net": "a net",
        "routes": "a route file",
        "additional": "an additional file",
        "viewsettings": "settings of sumo-gui",
        "snapshot": "a saved state",
        "meandata": "an output of SUMO",
        "fcd-export": "an output of SUMO",
        "tripinfos": "an output of SUMO",
        **dict.fromkeys(_NET_SOURCES, "a source of a net; give it to netconvert"),
    }
)

_REFUSED: Final[Mapping[str, frozenset[str]]] = MappingProxyType(
    {
        "routes": frozenset(_WHAT_IT_IS) - {"routes", "additional"},
        "additional": frozenset(_WHAT_IT_IS) - {"routes", "additional"},
    }
)
"""SUMO takes other roots, too, but these mean that the file is another one than thought."""


def root_problem(root: str, wanted: str) -> str | None:
    """What is wrong with a file that begins with `root` and is read as `wanted`.

    Args:
        root: name of its root element.
        wanted: `net`, `routes` or `additional`.
    """
    is_configuration = root.lower().endswith("configuration")
    refused = _REFUSED.get(wanted)
    is_wrong = root != wanted if refused is None else root in refused or is_configuration
    if not is_wrong:
        return None
    what = "a configuration" if is_configuration else _WHAT_IT_IS.get(root, "something else")
    return (
        f"this is no {_WHAT_IT_IS[wanted].partition(' ')[2]}: it begins with `<{root}>`, "
        f"which is {what}"
    )
