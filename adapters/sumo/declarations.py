"""What is wrong with declarations of entities, whatever the scene."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from adapters.sumo.connectors import RESERVED
from adapters.sumo.entities import Entity, Finish, Position, Synchronise, Trigger
from orchestrator.distribution import Constant
from orchestrator.errors import ParameterProblem
from orchestrator.suggestion import suggestion

_FARTHEST: Final = 1e6
"""From the origin [m]: farther is a mistake in writing."""

_ACTIONS: Final = ("synchronise", "speed_profile", "trajectory")


def misdeclared(entities: Mapping[str, Entity | None]) -> Iterator[ParameterProblem]:
    """What contradicts itself or is without effect in `entities`, each at its parameter."""
    for name, entity in entities.items():
        if entity is None:
            continue
        for what in _called(name, entity):
            yield ParameterProblem(("entities", name), what, at_key=True)
        found = (*_of(name, entity), *_names(name, entities), *_without_effect(entity))
        for key, what in found:
            yield ParameterProblem(("entities", name, *key.split(".")), what)
    yield from _cycles(entities)
    yield from _at_one_place(entities)


def _called(name: str, entity: Entity) -> Iterator[str]:
    if entity.is_driven and name in RESERVED:
        yield "is the name of other connectors; call the entity otherwise"
    if "." in name:
        yield "has a dot, which stands before the numbers of a queue; write a name without one"


def _of(name: str, entity: Entity) -> Iterator[tuple[str, str]]:
    if entity.is_roadside_unit:
        yield from _unit(entity)
        return
    yield from _position(entity.position)
    yield from _place(entity)
    yield from _movers(entity)
    yield from _times(entity)
    if entity.route and entity.to:
        yield "to", "there are both `route` and `to`; leave one out"
    if entity.synchronise is not None:
        yield from _synchronise(entity.synchronise)
    if entity.finish is not None:
        yield from _finish(entity.finish)
        if not entity.is_driven:
            yield "finish", "is for driven entities: write `controller: policy`, or leave it out"


def _position(at: Position) -> Iterator[tuple[str, str]]:
    if (at.x is None) != (at.y is None):
        yield "position", "has only one of `x` and `y`; write both"
    if at.lane and at.x is not None:
        yield "position", "has both `lane` and `x`, `y`; leave one out"
    if not at.lane and at.x is None and at.y is None:
        yield "position", "says no place; write `lane`, or `x` and `y`"
    if at.s is not None and at.to_end is not None:
        yield "position", "has both `s` and `to_end`; leave one out"
    yield from _finite(at)


def _finite(at: Position) -> Iterator[tuple[str, str]]:
    if any(not abs(value or 0.0) <= _FARTHEST for value in (at.x, at.y)):  # true for NaN
        yield "position", f"`x` and `y` must be finite and within +-{_FARTHEST:g} m"


def _unit(entity: Entity) -> Iterator[tuple[str, str]]:
    at = entity.position
    if at.x is None or at.y is None or at.lane or at.s is not None or at.to_end is not None:
        yield "position", "a roadside unit is on no lane; write `x` and `y`, and nothing else"
    yield from _finite(at)
    if entity.is_driven:
        yield "controller", "nobody drives a roadside unit; leave `controller` out"
    if entity.count != 1:
        yield "count", "a roadside unit is one; declare each by its name"
    for action in _actions(entity):
        yield action, f"a roadside unit does not move; leave `{action}` out"


def _place(entity: Entity) -> Iterator[tuple[str, str]]:
    on_lane, anywhere = bool(entity.position.lane), entity.position.x is not None
    movers = _moved_by(entity)
    if len(movers) == 1:  # or it is open which of them will stay
        (mover,) = movers
        if on_lane and mover == "trajectory":
            yield (
                "position",
                "who follows a trajectory starts at `x`, `y`; write them, and no `lane`",
            )
        if anywhere and not on_lane and mover not in {"trajectory", "parked"}:
            yield "position", f"`{mover}` is for those on a lane; write `lane` instead of `x`, `y`"
    if anywhere and not on_lane and entity.count > 1:
        yield "count", "a queue stands on a lane; set `position.lane`, or leave `count` out"
    if entity.is_driven and entity.count > 1:
        yield "count", "it is driven; declare each by its name, and leave `count` out"


def _moved_by(entity: Entity) -> list[str]:
    return [
        *["controller: policy"] * entity.is_driven,
        *["parked"] * entity.parked,
        *_actions(entity),
    ]


def _movers(entity: Entity) -> Iterator[tuple[str, str]]:
    movers = _moved_by(entity)
    if len(movers) > 1:
        key = movers[-1].partition(":")[0]
        named = " and ".join(f"`{mover}`" for mover in movers)
        yield key, f"the entity is moved by {named}; leave one"
    if entity.parked and entity.speed != Constant(0.0):
        yield "speed", "the entity is parked; leave `speed` or `parked` out"


def _times(entity: Entity) -> Iterator[tuple[str, str]]:
    times = [point.time for point in entity.speed_profile]
    if sorted(times) != times:
        yield "speed_profile", f"the times must not decrease, got {times}"
    times = [vertex.time for vertex in entity.trajectory]
    if not _increase(times):
        yield "trajectory", f"the times must increase, got {times}"


def _synchronise(wanted: Synchronise) -> Iterator[tuple[str, str]]:
    if wanted.min_speed > wanted.max_speed:
        yield "synchronise.min_speed", f"is above `max_speed`, {wanted.max_speed:g} m/s; lower it"
    if (wanted.x is None) != (wanted.y is None):
        yield "synchronise", "has only one of `x` and `y`; write both"


def _finish(wanted: Finish) -> Iterator[tuple[str, str]]:
    if (wanted.x is None) != (wanted.y is None):
        yield "finish", "has only one of `x` and `y`; write both"


def _actions(entity: Entity) -> list[str]:
    return [name for name in _ACTIONS if getattr(entity, name)]


def _increase(times: Sequence[float]) -> bool:
    return all(a < b for a, b in itertools.pairwise(times))


def _names(name: str, entities: Mapping[str, Entity | None]) -> Iterator[tuple[str, str]]:
    """Others whom `name` names and who cannot be meant; a trigger may name one of a queue."""
    entity = entities[name]
    assert entity is not None  # noqa: S101 - the caller knows
    wanted = {"trigger.entity": entity.trigger.entity}
    if entity.synchronise is not None:
        wanted["synchronise.entity"] = entity.synchronise.entity
    if entity.finish is not None:
        wanted["finish.crossing"] = entity.finish.crossing
    for key, other in wanted.items():
        queue, _, number = other.rpartition(".")
        is_of_queue = key == "trigger.entity" and queue in entities and number.isdigit()
        if other and other not in entities and not is_of_queue:
            others = entities.keys() - {name}
            yield key, f"no other entity is called `{other}`; {suggestion(other, others)}"
        declared = entities.get(other)
        if other == name:
            yield key, "is the entity itself; name another one"
            continue
        if declared is None:
            continue
        if key == "trigger.entity" and declared.count > 1:
            yield key, f"`{other}` is a queue; name one of it, for example `{other}.0`"
        if key != "trigger.entity" and declared.position.x is not None:
            yield key, f"`{other}` starts at `x`, `y` and has no way; name one who is on a lane"
        elif key == "synchronise.entity" and not declared.presence:
            yield key, f"`{other}` never takes part: its `presence` is 0"


def _without_effect(entity: Entity) -> Iterator[tuple[str, str]]:
    at = entity.position
    if entity.trigger.closer_than is not None and not entity.trigger.entity:
        yield "trigger.closer_than", "needs `trigger.entity`: closer to whom?"
    if entity.trigger != Trigger() and not (entity.speed_profile or entity.trajectory):
        what = "starts nothing; declare `speed_profile` or `trajectory`, or leave it out"
        yield "trigger", what
    if entity.is_roadside_unit:
        default = Entity(type=entity.type, position=at)
        for key in ("enters", "speed", "route", "to", "parked", "lidar"):
            if getattr(entity, key) != getattr(default, key):
                yield key, "means nothing for a roadside unit; leave it out"
        if 0.0 < entity.presence < 1.0:
            yield "presence", "of a roadside unit is 0 or 1"
    elif at.x is not None and not at.lane:
        if at.s is not None or at.to_end is not None:
            yield "position", "has `x` and `y`; leave out `s` and `to_end`, places on a lane"
        if entity.speed != Constant(0.0):
            yield "speed", "is of those on a lane; from `x`, `y` on, `trajectory` says how it moves"
        for key in ("route", "to"):
            if getattr(entity, key):
                yield key, "is of those on a lane; at `x`, `y`, write a `trajectory`"


def _cycles(entities: Mapping[str, Entity | None]) -> Iterator[ParameterProblem]:
    """Entities that are synchronised in a circle, each circle once, at its first member."""
    masters = {
        name: entity.synchronise.entity
        for name, entity in entities.items()
        if entity is not None and entity.synchronise is not None
    }
    seen: set[str] = set()
    for name in masters:
        way = [name]
        while way[-1] in masters and masters[way[-1]] not in way:
            way.append(masters[way[-1]])
        if masters.get(way[-1]) == name and len(way) > 1 and name not in seen:
            seen.update(way)
            circle = ", ".join(f"`{one}` with `{masters[one]}`" for one in way)
            what = f"goes round in a circle: {circle}; leave out one `synchronise`"
            yield ParameterProblem(("entities", name, "synchronise", "entity"), what)


def _at_one_place(entities: Mapping[str, Entity | None]) -> Iterator[ParameterProblem]:
    """Roadside units that stand where another one does: no radio can be nowhere from another."""
    known: dict[tuple[float, float], str] = {}
    for name, entity in entities.items():
        if entity is None or not entity.is_roadside_unit:
            continue
        at = entity.position
        if at.x is None or at.y is None:
            continue
        first = known.setdefault((at.x, at.y), name)
        if first != name:
            what = (
                f"is ({at.x:g}, {at.y:g}) m, the same place as that of `entities.{first}`; "
                "leave one out"
            )
            yield ParameterProblem(("entities", name, "position"), what)
