"""What to write instead of a name that does not exist."""

import difflib
from collections.abc import Iterable


def suggestion(name: str, offers: Iterable[str]) -> str:
    """The end of an error message about the unknown `name`: the nearest offer, or all of them."""
    known = sorted(offers)
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"did you mean `{close[0]}`?"
    return f"there are: {', '.join(known)}" if known else "there are none"
