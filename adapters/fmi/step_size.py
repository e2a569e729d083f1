"""The communication step sizes that an FMU with a fixed internal step can take."""

from fractions import Fraction

from orchestrator.exact import exact
from orchestrator.timebase import NANOSECONDS_PER_SECOND, StepSize


def internal_step(text: str | None) -> Fraction | None:
    """What `fixedInternalStepSize` says.

    Args:
        text: the attribute, `None` if it is missing.

    Returns:
        Seconds, exactly; `None` if it is missing or no positive number.
    """
    try:
        found = exact("0" if text is None else text)
    except ValueError:  # infinite, or none
        return None
    return found if found > 0 else None


def step_problem(internal: Fraction | None, step: StepSize) -> str | None:
    """Why a communication step size does not fit the internal one; `None` if it does.

    It has to be a whole multiple, to the nanosecond: files round numbers such as a third.

    Args:
        internal: [s], or `None`.
        step: [ns].
    """
    if internal is None:
        return None
    unit = internal * NANOSECONDS_PER_SECOND
    count = round(step / unit)
    if round(count * unit) == step:
        return None
    below = count if count * unit < step else count - 1
    near = " or ".join(f"{_text(n * internal)} s" for n in (below, below + 1) if n)
    return (
        f"is no whole multiple of the internal step of the FMU, {_text(internal)} s "
        f"(`fixedInternalStepSize`); write {near}"
    )


def _text(value: Fraction) -> str:
    return f"{float(value):.9g}"
