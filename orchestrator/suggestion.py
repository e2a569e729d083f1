"""What to write instead of a name that does not exist."""

import difflib
from collections.abc import Iterable


def nearest(name: str, offers: Iterable[str]) -> str | None:
    """The offer that `name` may be meant to be; `None` if it is like none of them."""
    close = difflib.get_close_matches(name, sorted(offers), n=1)
    return close[0] if close else None


def suggestion(name: str, offers: Iterable[str]) -> str:
    """The end of an error message about the unknown `name`: the nearest offer, or all of them."""
    known = sorted(offers)
    close = nearest(name, known)
    if close is not None:
        return f"did you mean `{close}`?"
    return f"there are: {', '.join(known)}" if known else "there are none"
