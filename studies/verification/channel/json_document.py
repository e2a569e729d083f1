"""JSON files whose values know their place, so that an error can name it."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.verification.channel.problems import GoldenError


@dataclass(frozen=True, slots=True)
class Node:
    """A value in a JSON file.

    Every method raises `GoldenError` if the value is not what it is taken for.

    Attributes:
        file: name of the file, for messages.
        place: e.g. `[3].queries[0].tx`; empty for the whole file.
        value: as `json` reads it.
    """

    file: str
    place: str
    value: Any

    def __getitem__(self, key: str) -> "Node":
        """The member `key` of an object."""
        members = self._of(dict, "an object")
        if key not in members:
            raise self.problem(f"`{key}` is missing")
        place = f"{self.place}.{key}" if self.place else key
        return Node(self.file, place, members[key])

    def __contains__(self, key: str) -> bool:
        """Whether an object has the member `key`."""
        return key in self._of(dict, "an object")

    def __iter__(self) -> Iterator["Node"]:
        """The elements of a list."""
        for k, value in enumerate(self._of(list, "a list")):
            yield Node(self.file, f"{self.place}[{k}]", value)

    def filled(self) -> list["Node"]:
        """The elements of a list that has any."""
        elements = list(self)
        if not elements:
            raise self.problem("must not be empty")
        return elements

    def text(self) -> str:
        """A string."""
        text: str = self._of(str, "a text")
        return text

    def number(self) -> float:
        """A finite number."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.problem(f"must be a number, not {self._shown()}")
        if not math.isfinite(self.value):
            raise self.problem(f"must be finite, not {self.value}")
        return float(self.value)

    def positive(self) -> float:
        """A number above 0."""
        number = self.number()
        if number <= 0:
            raise self.problem(f"must be positive, not {self.value}")
        return number

    def whole(self) -> int:
        """An integer; `3.0` is one."""
        number = self.number()
        if not number.is_integer():
            raise self.problem(f"must be a whole number, not {self.value}")
        return int(number)

    def numbers(self, count: int | None = None) -> list[float]:
        """A list of `count` finite numbers, or of any number of them."""
        found = [node.number() for node in self]
        if count is not None and len(found) != count:
            raise self.problem(f"must be {count} numbers, not {len(found)}")
        return found

    def problem(self, what: str) -> GoldenError:
        """The error that says `what` is wrong here."""
        place = f"{self.place}: " if self.place else ""
        return GoldenError([f"{self.file}: {place}{what}"])

    def _of(self, kind: type, name: str) -> Any:
        if not isinstance(self.value, kind):
            raise self.problem(f"must be {name}, not {self._shown()}")
        return self.value

    def _shown(self) -> str:
        text = json.dumps(self.value)
        return text if len(text) <= 40 else f"{text[:37]}..."


def read_json(path: Path, name: str) -> Node:
    """The JSON file at `path`, called `name` in messages.

    Raises:
        GoldenError: it cannot be read or is no JSON; the message names line and column.
    """
    try:
        return Node(name, "", json.loads(path.read_text(encoding="utf-8")))
    except json.JSONDecodeError as error:
        raise GoldenError([f"{name}:{error.lineno}:{error.colno}: {error.msg}"]) from error
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise GoldenError([f"{name}: cannot be read: {error}"]) from error
