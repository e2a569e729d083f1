"""What an entity says about others, and what it says without effect: checked before any run."""

from collections.abc import Iterator, Mapping

from adapters.sumo.entities import Entity, Trigger


def faults(entity: Entity, entities: Mapping[str, Entity | None]) -> list[str]:
    """What is wrong with the names that `entity` gives, and with keys that mean nothing alone.

    Args:
        entity: a declaration.
        entities: all of them.

    Returns:
        A sentence for each fault.
    """
    return [*_names(entity, entities), *_incomplete(entity), *_without_effect(entity)]


def _names(entity: Entity, entities: Mapping[str, Entity | None]) -> Iterator[str]:
    wanted = {"trigger.entity": entity.trigger.entity}
    if entity.synchronise is not None:
        wanted["synchronise.entity"] = entity.synchronise.entity
    if entity.finish is not None:
        wanted["finish.crossing"] = entity.finish.crossing
    for key, name in wanted.items():
        if not name or name in entities:
            continue
        queue, _, number = name.rpartition(".")
        if key == "trigger.entity" and queue in entities and number.isdigit():
            continue
        yield f"`{key}` is `{name}`, which is not declared; there are {', '.join(entities)}"
    queue = entity.trigger.entity
    other = entities.get(queue)
    if other is not None and other.count > 1:
        yield f"`trigger.entity` is `{queue}`, a queue; name one of it, for example `{queue}.0`"


def _incomplete(entity: Entity) -> Iterator[str]:
    for key, pair in (("synchronise", entity.synchronise), ("finish", entity.finish)):
        if pair is not None and (pair.x is None) != (pair.y is None):
            yield f"`{key}` has only one of `x` and `y`"
    if entity.trigger.closer_than is not None and not entity.trigger.entity:
        yield "`trigger.closer_than` needs `trigger.entity`: closer to whom?"


def _without_effect(entity: Entity) -> Iterator[str]:
    at = entity.position
    if at.x is not None and not entity.is_roadside_unit:
        if at.s is not None or at.to_end is not None:
            yield "`position` has `x` and `y`; leave out `s` and `to_end`, places on a lane"
        if entity.speed.highest > 0.0:
            yield "`speed` is of those on a lane; from `x`, `y` on, `trajectory` says how it moves"
        if entity.route or entity.to:
            yield "`route` and `to` are of those on a lane; at `x`, `y`, write a `trajectory`"
    if entity.trigger != Trigger() and not (entity.speed_profile or entity.trajectory):
        yield "`trigger` starts nothing; declare `speed_profile` or `trajectory`, or leave it out"
