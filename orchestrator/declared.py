"""What a component declares, once it is known to be a declaration."""

from collections.abc import Mapping
from typing import Any

from orchestrator.component import Component
from orchestrator.errors import ComponentError, CosimError, defects, in_words
from orchestrator.raised_at import raised_at
from orchestrator.signal import Connector


def not_a_mapping(outputs: Any) -> str:
    """What is wrong with what `Component.outputs` returned; empty if it has names and values."""
    if type(outputs) is dict or isinstance(outputs, Mapping):
        return ""
    return f"`outputs` returned `{type(outputs).__name__}`, not a mapping from names to values"


def declared(name: str, component: Component) -> dict[str, Connector]:
    """The connectors of `component`, asked for once.

    Args:
        name: of the component, for what is wrong with it.
        component: from wherever; its class may have been written a minute ago.

    Raises:
        ComponentError: it cannot say them, or what it says are none.
    """
    try:
        found: Any = component.connectors
    except CosimError:
        raise
    except defects() as error:
        what = f"cannot say its connectors: {in_words(error)}"
        raise ComponentError(name, None, what, raised_at(error)) from error
    if not isinstance(found, Mapping):
        kind = type(found).__name__
        what = f"`connectors` is of type `{kind}`, not a mapping from names to connectors"
        raise ComponentError(name, None, what)
    wrong = [
        f"`connectors` has under {key!r} a value of type `{type(value).__name__}`"
        for key, value in found.items()
        if not (isinstance(key, str) and isinstance(value, Connector))
    ]
    if wrong:
        raise ComponentError(name, None, f"{'; '.join(wrong)}: there belongs a `Connector`")
    return dict(found)
