"""How a process ended, in words."""

import signal


def ended(code: int) -> str:
    """What became of a process, as a predicate.

    Args:
        code: its exit code; the number of a signal is negative.
    """
    return f"was killed by {_name(-code)}" if code < 0 else f"exited with code {code}"


def _name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
