"""The connectors of the facilities layer: those of all vehicles, and those of each ego."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from fmus.messages.connectors import POSE_ERROR, inputs, outputs, when_undriven
from orchestrator.absence import Need, Undriven
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Connector

_EGO: Final = frozenset({"ego.id"})

INPUTS: Final[Mapping[str, Connector]] = when_undriven(
    inputs(
        "vehicle.id",
        "vehicle.position",
        "vehicle.heading",
        "vehicle.velocity",
        "vehicle.size",
        "vehicle.antenna_height",
        "vehicle.equipped",
        "ego.id",
        "apms",
        "objects",
        "features",
        "match.sharer",
        "match.trigger",
        "blind_zone.center",
        "blind_zone.range",
        "relay",
        "receptions",
        *POSE_ERROR,
    ),
    {
        "vehicle": Undriven("there is nobody who sends or receives a message"),
        "ego.id": Undriven(
            "there is no ego: `received.*` stays empty",
            Need.IF_OFFERED,
            frozenset({"match.sharer", "match.trigger", "blind_zone.center", "relay"}),
        ),
        "apms": Undriven("nobody sends APMs", Need.IF_OFFERED),
        "objects": Undriven("nobody sends objects", Need.IF_OFFERED),
        "features": Undriven("nobody sends features", Need.IF_OFFERED),
        "match": Undriven("the ego asks nobody for sensor data", Need.NEVER, _EGO),
        "blind_zone": Undriven("the ego asks for no blind zone", Need.NEVER, _EGO),
        "relay": Undriven("sensor data come over the direct link", Need.IF_OFFERED),
        "receptions": Undriven("nobody receives a message"),
        "pose_error": Undriven("every vehicle knows exactly where it is", Need.IF_OFFERED),
    },
)

OUTPUTS: Final[Mapping[str, Connector]] = {
    **outputs("packets", feedthrough=("vehicle.id", "apms", "objects", "features")),
    **outputs(
        "received.apms",
        "received.objects",
        "received.features",
        "received.sensor_data.count",
        "received.bsm.id",
        "received.bsm.position",
        "received.bsm.heading",
        "received.bsm.velocity",
        "received.bsm.size",
        "received.bsm.antenna_height",
        "received.bsm.age",
        feedthrough=("receptions",),
    ),
    **outputs(
        "received.link.transmitter",
        "received.link.receiver",
        "received.link.power",
        feedthrough=("receptions", "match.sharer"),
    ),
}

CONNECTORS: Final[Mapping[str, Connector]] = {**INPUTS, **OUTPUTS}
"""The connectors while the egos are not named."""

UNNAMED: Final = ""
"""Stands for the name of the only ego, where egos are not named."""

_OF_AN_EGO: Final = frozenset({"ego", "match", "blind_zone", "relay", "received"})
"""First parts of the names of all connectors that each ego has for itself."""
_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]*")


def of_ego(ego: str, connector: str) -> str:
    """What the connector `connector` of one ego, as in `CONNECTORS`, is called.

    Args:
        ego: its name: `first` has `first.id`, `first.match.sharer` and so on; or `UNNAMED`.
        connector: of an ego; one that all share keeps its name.
    """
    if ego == UNNAMED or not _is_of_an_ego(connector):
        return connector
    return f"{ego}.{connector.removeprefix('ego.')}"


def connectors(egos: Sequence[str]) -> Mapping[str, Connector]:
    """The connectors of a facilities layer.

    Args:
        egos: their names; none: there is one ego, and it has the connectors in `CONNECTORS`.

    Raises:
        ComponentTypeError: the names cannot be told apart, or cannot be names.
    """
    problems = list(_problems(egos))
    if problems:
        raise ComponentTypeError("; ".join(problems))
    return {
        of_ego(ego, name): _of_ego(ego, name) for name in CONNECTORS for ego in (egos or (UNNAMED,))
    }


def _is_of_an_ego(connector: str) -> bool:
    return connector.partition(".")[0] in _OF_AN_EGO


def _of_ego(ego: str, name: str) -> Connector:
    """The connector `of_ego(ego, name)`: an ego's axes are its own, as long as it needs."""
    connector = CONNECTORS[name]
    said = connector.undriven
    if ego == UNNAMED or not _is_of_an_ego(name):
        return connector
    return replace(
        connector,
        shape=tuple(f"{ego}.{n}" if isinstance(n, str) else n for n in connector.shape),
        feedthrough=frozenset(of_ego(ego, cause) for cause in connector.feedthrough),
        undriven=said
        and replace(said, beside=frozenset(of_ego(ego, each) for each in said.beside)),
    )


def _problems(egos: Sequence[str]) -> Iterator[str]:
    shared = {name.partition(".")[0] for name in CONNECTORS if not _is_of_an_ego(name)}
    for ego in dict.fromkeys(egos):
        if egos.count(ego) > 1:
            yield f"`egos` names `{ego}` {egos.count(ego)} times; name each ego once"
        if not _NAME.fullmatch(ego):
            yield f"`egos`: `{ego}` is no name; write letters, digits, `_` and `-` (not first)"
        elif ego in shared:
            yield f"`egos`: `{ego}` is what connectors of all vehicles are called; choose another"
