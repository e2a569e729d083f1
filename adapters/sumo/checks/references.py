"""What entities refer to: lanes, edges and vehicle types that a scene does not have."""

from collections.abc import Collection, Iterator, Mapping

from adapters.sumo.checks.net import Roads
from adapters.sumo.entities import Entity
from orchestrator.errors import Location, ParameterProblem
from orchestrator.suggestion import suggestion


def missing_references(
    entities: Mapping[str, Entity | None], roads: Roads, types: Collection[str]
) -> Iterator[ParameterProblem]:
    """Lanes, edges and vehicle types that are named and not there.

    Args:
        entities: of a scenario.
        roads: of the net; nothing is looked up in a net that could not be read.
        types: vehicle types of the scene.
    """
    for name, entity in entities.items():
        if entity is None:
            continue
        address = ("entities", name)
        yield from _missing((*address, "type"), "vehicle type", entity.type, types, entity)
        if roads.complete:
            lane = entity.position.lane
            yield from _missing((*address, "position", "lane"), "lane", lane, roads.lanes, entity)
            for k, edge in enumerate(entity.route):
                yield from _missing((*address, "route", k), "edge", edge, roads.edges, entity)
            yield from _missing((*address, "to"), "edge", entity.to, roads.edges, entity)


def names_taken(
    entities: Mapping[str, Entity | None], declared: Mapping[tuple[str, str], Location]
) -> Iterator[ParameterProblem]:
    """Entities whose names vehicles of the scene have, now or when they depart.

    Args:
        entities: of a scenario.
        declared: where the scene declares ids, by kind and id.
    """
    for name, entity in entities.items():
        where = declared.get(("vehicle", name))
        if entity is not None and where is not None:
            what = f"a vehicle of the scene has this name ({where}); call the entity otherwise"
            yield ParameterProblem(("entities", name), what, at_key=True)


def _missing(
    address: tuple[str | int, ...], noun: str, name: str, known: Collection[str], entity: Entity
) -> Iterator[ParameterProblem]:
    if name and name not in known and not (noun == "vehicle type" and entity.is_roadside_unit):
        what = f"the scene has no {noun} `{name}`; {suggestion(name, list(known))}"
        yield ParameterProblem(address, what)
