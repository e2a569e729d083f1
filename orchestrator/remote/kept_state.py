"""States of remote components, which their hosts keep."""

from orchestrator.signal import Signals


class RemoteState:
    """The state of a remote component.

    Attributes:
        number: by which the host knows it.
        values: the outputs at that time.
    """

    __slots__ = ("__weakref__", "number", "values")

    def __init__(self, number: int, values: Signals) -> None:
        self.number = number
        self.values = values
