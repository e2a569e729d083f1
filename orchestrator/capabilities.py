"""What a component may be able to do beyond its contract.

Each capability is an abstract class. `Component.capability` says whether a component has it; it is
asked once, when a run is assembled. A component in Python has those that it derives from, in
addition to `Component`:

    class Plant(RestorableComponent[float], VariableSteps): ...
"""

import abc
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from orchestrator.course import Course
from orchestrator.signal import Signals
from orchestrator.timebase import Time


class InitialEvaluation(abc.ABC):
    """Outputs can be computed for several inputs before the first step (FMI: initialisation mode).

    By it, components that depend on each other at the start are initialised together.
    """

    @abc.abstractmethod
    def evaluate(self, inputs: Signals) -> Signals:
        """Every output at the current communication point, if these were the inputs. No effect.

        Called between `setup` and `initialise`, any number of times.

        Args:
            inputs: every input connector by name.
        """


class PointEvaluation(InitialEvaluation):
    """Outputs can be computed anew for other inputs at every communication point.

    `evaluate` is called between two steps as well; see `orchestrator.algorithm.jacobi`.
    """


class CourseFollowing(abc.ABC):
    """Real inputs may change during a step (FMI 2.0: `canInterpolateInputs`)."""

    @property
    @abc.abstractmethod
    def input_degree(self) -> int:
        """The highest degree of the polynomials that inputs may follow; at least 1."""

    @abc.abstractmethod
    def follow(self, courses: Mapping[str, Course]) -> None:
        """Let these inputs change over the next step; all others are constant.

        Called before each `step` over which an input changes. The `inputs` of that step are the
        values at its start.

        Args:
            courses: by input, over that step, of degree `input_degree` at most.
        """


class OutputSlopes(abc.ABC):
    """The rates of change of outputs are known (FMI: `maxOutputDerivativeOrder`)."""

    @abc.abstractmethod
    def slopes(self) -> Signals:
        """Time derivatives of outputs at the current communication point [unit/s]. No effect.

        Returns:
            By output, those of continuous ones that are known, each of the shape of the output.
            Those with direct feedthrough are used only where the component was told by `follow`
            how these inputs change.
        """


class OutputSelection(abc.ABC):
    """Outputs that nobody looks at can be left out (FMI: they are not got)."""

    @abc.abstractmethod
    def select(self, names: Collection[str] | None) -> None:
        """Let `outputs` have these only from now on; with `None` all again, as they are now.

        Called between two steps, after `initialise`. `evaluate`, if there is one, follows suit.

        Args:
            names: of outputs.
        """


class VariableSteps:
    """Steps may differ in length (FMI: `canHandleVariableCommunicationStepSize`).

    A step may also be made as several shorter ones.
    """


class PortableState(abc.ABC):
    """Its state can be turned into bytes and back (FMI: `canSerializeFMUState`)."""

    @abc.abstractmethod
    def dump(self) -> bytes:
        """The state at the current communication point, its inputs and outputs included. No effect.

        A component of the same type and parameters can go on from it, in any process.
        """

    @abc.abstractmethod
    def load(self, content: bytes) -> None:
        """Return to a state that was dumped, by this component or another one like it.

        Called between `initialise` and `close`, as `dump`.

        Raises:
            CosimError: these are no bytes of such a state.
        """


class DirectionalDerivatives(abc.ABC):
    """How outputs change with inputs is known (FMI: `providesDirectionalDerivatives`)."""

    @abc.abstractmethod
    def directional(self, change: Signals) -> Signals:
        """How fast outputs change while inputs change: the Jacobian times `change`. No effect.

        It holds at the current communication point, for the inputs that were given last.

        Args:
            change: by input, some of the continuous ones, each a float64 array of the shape of the
                input; all others are constant.

        Returns:
            By output, every continuous one that depends on inputs or is known not to, float64
            arrays of the shapes of the outputs, in their units for the units of the inputs.
        """


class AdjointDerivatives(abc.ABC):
    """How inputs contribute to outputs is known (FMI 3.0: `providesAdjointDerivatives`)."""

    @abc.abstractmethod
    def adjoint(self, weight: Signals) -> Signals:
        """The gradient of weighted outputs by the inputs: `weight` times the Jacobian. No effect.

        It holds at the current communication point, for the inputs that were given last.

        Args:
            weight: by output, some of the continuous ones, each a float64 array of the shape of the
                output.

        Returns:
            By input, every continuous one, float64 arrays of the shapes of the inputs.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class EndRequest:
    """A component asks for the end of the run.

    Attributes:
        time: how far it has come [ns]: the end of its last step, or before, if it could not make
            all of that. Then the step counts as not made, and the run ends before its end.
        why: a few words for the user.
    """

    time: Time
    why: str


class EndRequesting(abc.ABC):
    """May ask that the run end here, as if it were the stop time (FMI: `terminateSimulation`)."""

    @property
    @abc.abstractmethod
    def end_request(self) -> EndRequest | None:
        """What it asks for since the last `initialise` or `step`; `None`: to go on. No effect."""


class Redrawing(abc.ABC):
    """What it is still to draw can be drawn anew, in the middle of a run.

    A branch of the run asks for it, in which a decision is tried; see `orchestrator.branching`.
    """

    @abc.abstractmethod
    def redraw(self, rng: np.random.Generator) -> None:
        """Draw from `rng`, instead of the stream given to `setup`, from now on.

        What was drawn before stays. Called between two steps.

        Args:
            rng: to draw from; equal streams give equal draws where equal things are decided.
        """
