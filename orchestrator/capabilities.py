"""What a component may be able to do beyond its contract.

Each capability is an abstract class. `Component.capability` says whether a component has it; it is
asked once, when a run is assembled. A component in Python has those that it derives from, in
addition to `Component`:

    class Plant(RestorableComponent[float], VariableSteps): ...
"""

import abc
from collections.abc import Collection, Mapping

from orchestrator.course import Course
from orchestrator.signal import Signals


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
