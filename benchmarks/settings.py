"""Settings of benchmarks, as `nlosim bench --set NAME=VALUE` gives them."""

from collections.abc import Mapping

from orchestrator.errors import CosimError


class WholeNumberError(CosimError):
    """A setting is no whole number, or too small. Exit code 2."""


def whole_number(settings: Mapping[str, str], name: str, least: int) -> int:
    """The whole number that the setting `name` says.

    Raises:
        WholeNumberError: it says none, or one below `least`.
    """
    text = settings[name]
    if not text.isdecimal() or int(text) < least:
        raise WholeNumberError(f"`{name}` is `{text}`; write a whole number from {least} on")
    return int(text)
