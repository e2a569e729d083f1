"""Errors of code that is neither ours nor a component's get the name of whoever raised them."""

from collections.abc import Iterator
from contextlib import contextmanager

from orchestrator.errors import CosimError, PluginError, defects, in_words
from orchestrator.raised_at import raised_at


@contextmanager
def blamed(what: str, *, says: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Call code of `what`, e.g. "the measure `span`", which is named if it fails.

    Args:
        what: is called.
        says: errors that it may raise to say what is wrong, beside `CosimError` and `OSError`.

    Raises:
        PluginError: it raised anything else.
    """
    known: tuple[type[Exception], ...] = (CosimError, OSError, *says)
    try:
        yield
    except known:
        raise
    except defects() as error:
        raise PluginError(f"{what} failed: {in_words(error)}", raised_at(error)) from error
