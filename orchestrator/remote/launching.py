"""Components in other processes: they look like any other component.

    specs = [ComponentSpec(name="traffic", type="sumo-traffic", values={...}), ...]
    with launch(specs, ZenohTransport()) as remote:
        system = System({**local, **remote}, ...)
        simulate(system, ...)

Nothing started by `launch` outlives its `with` block.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from types import MappingProxyType

from orchestrator.component import ConcurrentComponent
from orchestrator.errors import ComponentTypeError
from orchestrator.limits import USUAL, Deadlines, Limits, OnFailure
from orchestrator.remote.admission import digest_of
from orchestrator.remote.component import RemoteComponent, RestorableRemoteComponent
from orchestrator.remote.dialogue import Company, Dialogue
from orchestrator.remote.naming import Sites
from orchestrator.remote.protocol import Kind
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Transport


@contextmanager
def launch(
    specs: Sequence[ComponentSpec],
    transport: Transport,
    *,
    deadlines: Deadlines | None = None,
    limits: Mapping[str, Limits] = MappingProxyType({}),
) -> Iterator[Mapping[str, ConcurrentComponent]]:
    """Create remote components, all at the same time, and end their hosts with the block.

    Args:
        specs: one per component; names are unique.
        transport: closed with the block, too.
        deadlines: when a silent host counts as hung.
        limits: of single components by name, in place of `deadlines`.

    Yields:
        The components by name, in the order of `specs`.

    Raises:
        ComponentTypeError: types or parameters are wrong; all of these in one text.
        ComponentError: a host did not start, or died.
    """
    common = USUAL if deadlines is None else Limits(deadlines=deadlines)
    limited = {spec.name: limits.get(spec.name, common) for spec in specs}
    documents = {spec.name: spec.to_document() for spec in specs}
    longest = max((each.deadlines.create for each in limited.values()), default=0.0)
    transport.admit({name: digest_of(document) for name, document in documents.items()})
    with transport:
        links = transport.open(tuple(documents), longest)
        company = Company()
        dialogues = {name: Dialogue(name, links[name], company) for name in documents}
        for name, dialogue in dialogues.items():
            links[name].limit_memory(limited[name].memory)
            create = limited[name].deadlines.create
            dialogue.ask(Kind.CREATE, create, document=documents[name])

        def renew(name: str) -> None:
            """Start another host for the component, and have it created there."""
            limits_of, dialogue = limited[name], dialogues[name]
            create = limits_of.deadlines.create
            link = transport.renew(name, create)
            link.limit_memory(limits_of.memory)
            dialogue.renew(link)
            dialogue.ask(Kind.CREATE, create, document=documents[name])
            dialogue.answer()

        yield _created(dialogues, limited, renew)


def _created(
    dialogues: Mapping[str, Dialogue],
    limits: Mapping[str, Limits],
    renew: Callable[[str], None],
) -> Mapping[str, ConcurrentComponent]:
    components: dict[str, ConcurrentComponent] = {}
    sites = Sites()
    errors: list[str] = []
    for name, dialogue in dialogues.items():
        try:
            created = dialogue.answer()
            own = limits[name]
            again = partial(renew, name) if own.on_failure is OnFailure.RESTART else None
            dialogue.is_renewable = again is not None
            remote = RemoteComponent(dialogue, created, own.deadlines, again, sites)
            # states that a host keeps go with it
            is_restorable = again is None and created.message.document.get("restorable", False)
            components[name] = RestorableRemoteComponent(remote) if is_restorable else remote
        except ComponentTypeError as error:
            errors.append(f"component `{name}`: {error}")
    if errors:
        raise ComponentTypeError("\n".join(errors))
    return MappingProxyType(components)
