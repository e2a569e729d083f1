"""What a component can do, if its FMU is integrated here."""

from collections.abc import Callable, Mapping

from typing_extensions import override

from adapters.fmi.component import FmuComponent
from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange.instance import ModelExchangeInstance
from adapters.fmi.state import FmuState
from orchestrator.capabilities import (
    CourseFollowing,
    InitialEvaluation,
    OutputSlopes,
    PointEvaluation,
    VariableSteps,
)
from orchestrator.component import Capability, WrappedComponent, WrappedRestorableComponent
from orchestrator.course import Course
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.timebase import Duration, Time

_ANY_DEGREE = 9
"""More than anybody extrapolates with: courses are evaluated inside of the right-hand side."""


class Instances:
    """Makes the instances of one component, and knows the one that runs.

    Args:
        make: a new one.
    """

    def __init__(self, make: Callable[[], ModelExchangeInstance]) -> None:
        self._make = make
        self._current: ModelExchangeInstance | None = None

    def __call__(self) -> ModelExchangeInstance:
        """Make one, which is the current one from now on."""
        self._current = self._make()
        return self._current

    @property
    def current(self) -> ModelExchangeInstance:
        """The one that was made last."""
        if self._current is None:
            raise FmuError("the FMU is not running: `setup` comes first")
        return self._current


class ModelExchangeComponent(
    WrappedComponent, PointEvaluation, CourseFollowing, OutputSlopes, VariableSteps
):
    """An FMU for Model Exchange in this process.

    Args:
        component: the FMU, of which a step is an integration.
        instances: those of the component.
        has_slopes: whether an output is a state.
        may_restore: whether the FMU can return to an earlier state.
    """

    def __init__(
        self, component: FmuComponent, instances: Instances, *, has_slopes: bool, may_restore: bool
    ) -> None:
        super().__init__(component)
        self._component = component
        self._instances = instances
        connectors = component.connectors
        offered: dict[type, bool] = {
            PointEvaluation: may_restore or not _leads_discrete_inputs_through(connectors),
            CourseFollowing: any(map(_runs, connectors.values())),
            OutputSlopes: has_slopes,
        }
        self._missing = {kind for kind, is_there in offered.items() if not is_there}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._component.step(inputs, t, h)

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        if kind in self._missing:
            return None
        if kind in {InitialEvaluation, PointEvaluation}:
            initial = self._component.capability(InitialEvaluation)  # type: ignore[type-abstract]
            return None if initial is None or not isinstance(self, kind) else self
        return self if isinstance(self, kind) else self._component.capability(kind)

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return self._component.evaluate(inputs)

    @property
    @override
    def input_degree(self) -> int:
        return _ANY_DEGREE

    @override
    def follow(self, courses: Mapping[str, Course]) -> None:
        self._instances.current.follow(courses)

    @override
    def slopes(self) -> Signals:
        return self._instances.current.slopes()


class RestorableModelExchangeComponent(WrappedRestorableComponent[FmuState]):
    """One that can return to an earlier state (FMI: `canGetAndSetFMUState`)."""

    def __init__(self, component: ModelExchangeComponent, keeper: FmuComponent) -> None:
        super().__init__(component, keeper)


def _leads_discrete_inputs_through(connectors: Mapping[str, Connector]) -> bool:
    """Whether an output depends on an input that can change at events only."""
    discrete = {
        name
        for name, c in connectors.items()
        if c.causality is Causality.INPUT and c.variability is not Variability.CONTINUOUS
    }
    return any(discrete & c.feedthrough for c in connectors.values())


def _runs(connector: Connector) -> bool:
    return (
        connector.causality is Causality.INPUT and connector.variability is Variability.CONTINUOUS
    )
