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
        if entity.is_driven and name in RESERVED:
            what = "is the name of other connectors; call the entity otherwise"
            yield ParameterProblem(("entities", name), what, at_key=True)
        found = (
            *_of(name, entity),
            *_names(entity, entities),
            *_others(name, entity, entities),
            *_without_effect(entity),
        )
        for key, what in found:
            yield ParameterProblem(("entities", name, *key.split(".")), what)
    yield from _at_one_place(entities)


def _of(name: str, entity: Entity) -> Iterator[tuple[str, str]]:
    yield from _position(entity.position)
    if entity.is_roadside_unit:
        yield from _unit(entity)
        return
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
        yield "position", "says neither `lane` nor both `x` and `y`"
    if at.s is not None and at.to_end is not None:
        yield "position", "has both `s` and `to_end`; leave one out"
    if any(not abs(value or 0.0) <= _FARTHEST for value in (at.x, at.y)):  # true for NaN
        yield "position", f"x and y must be finite and within +-{_FARTHEST:g} m"


def _unit(entity: Entity) -> Iterator[tuple[str, str]]:
    if entity.position.lane:
        yield "position", "a roadside unit needs `position.x` and `.y`"
    if entity.is_driven:
        yield "controller", "nobody drives a roadside unit; leave `controller` out"
    if entity.count != 1:
        yield "count", "a roadside unit is one; declare each by its name"
    for action in _actions(entity):
        yield action, f"a roadside unit does not move; leave `{action}` out"


def _place(entity: Entity) -> Iterator[tuple[str, str]]:
    on_lane = bool(entity.position.lane)
    if on_lane and entity.trajectory:
        yield "position", "who follows a trajectory is placed by `position.x`, `.y`"
    needs_lane = [name for name in ("synchronise", "speed_profile") if getattr(entity, name)]
    needs_lane += ["controller"] * entity.is_driven
    if not on_lane and needs_lane:
        yield "position", f"must be on a lane because of `{needs_lane[0]}`: set `position.lane`"
    if not on_lane and entity.count > 1:
        yield "count", "a queue stands on a lane; set `position.lane`, or `count: 1`"
    if entity.is_driven and entity.count > 1:
        yield "count", "it is driven; declare each by its name, and leave `count` out"


def _movers(entity: Entity) -> Iterator[tuple[str, str]]:
    movers = [
        *["controller: policy"] * entity.is_driven,
        *["parked"] * entity.parked,
        *_actions(entity),
    ]
    if len(movers) > 1:
        key = movers[-1].partition(":")[0]
        yield key, f"the entity is moved by {' and '.join(movers)}; leave one"
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
        yield "synchronise.min_speed", "is above `max_speed`"
    if (wanted.x is None) != (wanted.y is None):
        yield "synchronise", "has only one of `x` and `y`; write both"


def _finish(wanted: Finish) -> Iterator[tuple[str, str]]:
    if (wanted.x is None) != (wanted.y is None):
        yield "finish", "has only one of `x` and `y`; write both"


def _others(
    name: str, entity: Entity, entities: Mapping[str, Entity | None]
) -> Iterator[tuple[str, str]]:
    """Whether those whose way matters have one."""
    wanted = {}
    if entity.synchronise is not None:
        wanted["synchronise.entity"] = entity.synchronise.entity
    if entity.finish is not None:
        wanted["finish.crossing"] = entity.finish.crossing
    for key, other in wanted.items():
        found = entities.get(other)
        if other == name:
            yield key, "is the entity itself; name another one"
        elif found is not None and not found.position.lane:
            yield key, f"`{other}` is placed by coordinates and has no way; name one on a lane"
        elif key == "synchronise.entity" and found is not None and not found.presence:
            yield key, f"`{other}` never takes part: its `presence` is 0"


def _actions(entity: Entity) -> list[str]:
    return [name for name in _ACTIONS if getattr(entity, name)]


def _increase(times: Sequence[float]) -> bool:
    return all(a < b for a, b in itertools.pairwise(times))


def _names(entity: Entity, entities: Mapping[str, Entity | None]) -> Iterator[tuple[str, str]]:
    """Others that are named and not declared; a trigger may name one of a queue."""
    wanted = {"trigger.entity": entity.trigger.entity}
    if entity.synchronise is not None:
        wanted["synchronise.entity"] = entity.synchronise.entity
    if entity.finish is not None:
        wanted["finish.crossing"] = entity.finish.crossing
    for key, name in wanted.items():
        queue, _, number = name.rpartition(".")
        is_of_queue = key == "trigger.entity" and queue in entities and number.isdigit()
        if name and name not in entities and not is_of_queue:
            yield key, f"no entity `{name}` is declared; {suggestion(name, entities)}"
    queue = entity.trigger.entity
    other = entities.get(queue)
    if other is not None and other.count > 1:
        yield "trigger.entity", f"`{queue}` is a queue; name one of it, for example `{queue}.0`"


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
    elif at.x is not None:
        if at.s is not None or at.to_end is not None:
            yield "position", "has `x` and `y`; leave out `s` and `to_end`, places on a lane"
        if entity.speed != Constant(0.0):
            yield "speed", "is of those on a lane; from `x`, `y` on, `trajectory` says how it moves"
        for key in ("route", "to"):
            if getattr(entity, key):
                yield key, "is of those on a lane; at `x`, `y`, write a `trajectory`"


def _at_one_place(entities: Mapping[str, Entity | None]) -> Iterator[ParameterProblem]:
    """Roadside units that stand where another one does: no radio can be nowhere from another."""
    known: dict[tuple[float | None, float | None], str] = {}
    for name, entity in entities.items():
        if entity is None or not entity.is_roadside_unit or entity.position.x is None:
            continue
        at = entity.position
        first = known.setdefault((at.x, at.y), name)
        if first != name:
            what = (
                f"is ({at.x:g}, {at.y:g}) m, the same place as that of `entities.{first}`; "
                "leave one out"
            )
            yield ParameterProblem(("entities", name, "position"), what)
