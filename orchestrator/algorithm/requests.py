"""Which components ask for the end of the run, and where."""

from typing_extensions import override

from orchestrator.capabilities import EndRequest, EndRequesting
from orchestrator.component import Component
from orchestrator.timebase import Time


class EndedWithinStep(Exception):  # noqa: N818  (a component may end a run; that is no error)
    """A component asks for the end and did not come to the end of its step.

    Attributes:
        component: its name.
        request: what it asks for.
    """

    def __init__(self, component: str, request: EndRequest) -> None:
        super().__init__(component)
        self.component = component
        self.request = request

    @override
    def __str__(self) -> str:
        return f"`{self.component}` ended at {self.request.time} ns, within its step"


class Requests:
    """Where the components of a run ask for its end, as far as that is published.

    Attributes:
        published: by name.
    """

    __slots__ = ("published",)

    def __init__(self) -> None:
        self.published: dict[str, EndRequest] = {}


class Asking:
    """What one component asks for.

    Args:
        name: of the component.
        component: the same.
    """

    __slots__ = ("_component", "_is_within", "_name", "_request", "requests")

    def __init__(self, name: str, component: Component) -> None:
        self._name = name
        self._component = component.capability(EndRequesting)  # type: ignore[type-abstract]
        self._request: EndRequest | None = None
        self._is_within = False
        self.requests = Requests()

    def is_within(self, end: Time) -> bool:
        """Hear it after a step to `end` [ns]; whether it did not make all of that."""
        if self._component is None:
            return False
        request = self._request = self._component.end_request
        self._is_within = request is not None and request.time < end
        return self._is_within

    @property
    def has_ended(self) -> bool:
        """Whether it did not come to the end of its last step."""
        return self._is_within

    @property
    def request(self) -> EndRequest | None:
        """What it asked for when it was heard last."""
        return self._request

    def check(self) -> None:
        """Go on, if the last step was made to its end.

        Raises:
            EndedWithinStep: it was not.
        """
        if self._is_within and self._request is not None:
            raise EndedWithinStep(self._name, self._request)

    def publish(self) -> None:
        """Let its request count, as the end of the last step is published."""
        if self._component is None:
            return
        if self._request is not None:
            self.requests.published[self._name] = self._request
        else:
            self.requests.published.pop(self._name, None)
