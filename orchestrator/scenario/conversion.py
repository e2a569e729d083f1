"""Structured parameter values: records, lists, records by name and distributions.

Every problem is found, and each has the address of what is wrong.
"""

import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from orchestrator.distribution import (
    Choice,
    Constant,
    DistributedText,
    Distribution,
    Normal,
    Uniform,
)
from orchestrator.kinds import FrozenMapping, Leaf, Listed, Named, Optional, Record, kind_of
from orchestrator.parameters import REQUIRED, Parameter, ParameterProblem, declared
from orchestrator.scenario.diagnosis import show
from orchestrator.scenario.document import Address
from orchestrator.scenario.kind_names import missing
from orchestrator.scenario.scalars import ScalarProblem, convert_scalar
from orchestrator.scenario.units import difference
from orchestrator.suggestion import suggestion

DISTRIBUTIONS: Final = ("uniform", "normal", "choice")
"""The key of a distribution; no name of a record may be one of them (see `extension`)."""

NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]*")

_FORMS: Final = "`{uniform: [low, high]}`, `{normal: {...}}` or `{choice: [...]}`"


class Conversion:
    """One walk over parameters that a file gives, collecting problems.

    Args:
        folder: where relative paths start that stand at an address.

    Attributes:
        problems: so far, by the address of what is wrong.
    """

    def __init__(self, folder: Callable[[Address], Path]) -> None:
        self._folder = folder
        self.problems: list[ParameterProblem] = []

    def parameters(
        self, declared: Mapping[str, Parameter], given: Mapping[str, Any], address: Address = ()
    ) -> dict[str, Any]:
        """The parameters that are given and right, as the component receives them.

        Args:
            declared: by name.
            given: what the file says, by name.
            address: of `given`.
        """
        found = {}
        for name, said in given.items():
            here = (*address, name)
            if name not in declared:
                what = f"there is no parameter `{name}`; {suggestion(name, declared)}"
                self._add(here, what, at_key=True)
                continue
            before = len(self.problems)
            value = self.value(declared[name].type, declared[name], said, here)
            if len(self.problems) == before:
                found[name] = value
        for name, parameter in declared.items():
            if parameter.default is REQUIRED and name not in given:
                self._add(address, missing(name, parameter), at_key=True)
        return found

    def value(self, annotation: Any, parameter: Parameter, said: Any, address: Address) -> Any:
        """The value in the type `annotation`; of no meaning if there are problems with it.

        Args:
            annotation: the type of `parameter`, or a part of it.
            parameter: whose unit and bounds hold.
            said: what the file says.
            address: of `said`.
        """
        match kind_of(annotation):
            case Optional(inner):
                return None if said is None else self.value(inner, parameter, said, address)
            case Listed(item):
                return self._listed(item, parameter, said, address)
            case Named(inner):
                return self._named(inner, parameter, said, address)
            case Record(found):
                return self._record(found, said, address)
            case Leaf(kind):
                return self._leaf(kind, parameter, said, address)

    def _add(self, address: Address, what: str, *, at_key: bool = False) -> None:
        self.problems.append(ParameterProblem(address, what, at_key))

    def _scalar(self, kind: Any, parameter: Parameter, said: Any, address: Address) -> Any:
        try:
            return convert_scalar(kind, parameter, said, self._folder(address))
        except ScalarProblem as problem:
            self._add(address, str(problem))
            return None

    def _leaf(self, kind: Any, parameter: Parameter, said: Any, address: Address) -> Any:
        if kind is Distribution:
            return self._distribution(parameter, said, address)
        if kind is DistributedText:
            return self._distributed_text(parameter, said, address)
        return self._scalar(kind, parameter, said, address)

    def _listed(
        self, item: Any, parameter: Parameter, said: Any, address: Address
    ) -> tuple[Any, ...]:
        if not isinstance(said, list):
            example = f"[{show(said)}]" if not isinstance(said, dict) else "[...]"
            self._add(address, f"expected a list, got {show(said)}; write `{example}`")
            return ()
        found = [self.value(item, parameter, s, (*address, i)) for i, s in enumerate(said)]
        return tuple(found)

    def _named(
        self, annotation: Any, parameter: Parameter, said: Any, address: Address
    ) -> FrozenMapping[Any]:
        if not isinstance(said, dict):
            what = f"expected a mapping of names, got {show(said)}; write lines `name: ...`"
            self._add(address, what)
            return FrozenMapping({})
        for name in said:
            if not NAME.fullmatch(name):
                what = f"`{name}` cannot be a name; write letters, digits, `_` and `-` (not first)"
                self._add((*address, name), what, at_key=True)
            elif name in DISTRIBUTIONS:
                what = f"`{name}` cannot be a name; it is the word for a distribution"
                self._add((*address, name), what, at_key=True)
        return FrozenMapping(
            {n: self.value(annotation, parameter, s, (*address, n)) for n, s in said.items()}
        )

    def _record(self, record: type, said: Any, address: Address) -> Any:
        if not isinstance(said, dict):
            keys = ", ".join(f"{name}: ..." for name in list(declared(record))[:2])
            what = f"expected a mapping of `key: value` lines, got {show(said)}"
            self._add(address, f"{what}; write `{{{keys}}}`")
            return None
        before = len(self.problems)
        found = self.parameters(declared(record), said, address)
        return self._made(record, before, address, found)

    def _made(
        self, build: Callable[..., Any], before: int, address: Address, values: Mapping[str, Any]
    ) -> Any:
        """What `build` makes of values, unless there are more problems than `before`."""
        if len(self.problems) > before:
            return None
        try:
            return build(**values)
        except ValueError as error:
            self._add(address, str(error), at_key=True)
            return None

    def _distribution(self, parameter: Parameter, said: Any, address: Address) -> Any:
        before = len(self.problems)
        number = _number_of(parameter)
        if isinstance(said, list):
            self._add(address, f"expected a number or a distribution, got a list; write {_FORMS}")
            return None
        if not isinstance(said, dict):
            value = self._scalar(float, number, said, address)
            return self._made(Constant, before, address, {"value": value})
        word = self._word(said, DISTRIBUTIONS, address)
        if word is None:
            return None
        here, inner = (*address, word), said[word]
        match word:
            case "uniform":
                return self._uniform(number, inner, here)
            case "normal":
                return self._normal(number, inner, here)
        return self._choice(Choice, tuple[float, ...], number, inner, here)

    def _distributed_text(self, parameter: Parameter, said: Any, address: Address) -> Any:
        if not isinstance(said, dict):
            before = len(self.problems)
            value = self._scalar(str, parameter, said, address)
            return self._made(DistributedText, before, address, {"values": (value,)})
        if self._word(said, ("choice",), address) is None:
            return None
        here = (*address, "choice")
        return self._choice(DistributedText, tuple[str, ...], parameter, said["choice"], here)

    def _word(
        self, said: Mapping[str, Any], words: tuple[str, ...], address: Address
    ) -> str | None:
        """The only key, if it is one of the words."""
        unknown = [key for key in said if key not in words]
        for key in unknown:
            what = f"there is no distribution `{key}`; {suggestion(key, words)}"
            self._add((*address, key), what, at_key=True)
        if unknown:
            return None
        if len(said) != 1:
            forms = _FORMS if len(words) > 1 else "`{choice: [...]}`"
            self._add(address, f"expected one distribution, got {len(said)}; write {forms}")
            return None
        return next(iter(said))

    def _uniform(self, number: Parameter, said: Any, address: Address) -> Any:
        before = len(self.problems)
        bounds = self._listed(float, number, said, address)
        if len(self.problems) == before and len(bounds) != 2:
            what = f"expected two bounds, got {len(bounds)}; write `[low, high]`"
            self._add(address, what)
        return self._made(
            Uniform, before, address, dict(zip(("low", "high"), bounds, strict=False))
        )

    def _normal(self, number: Parameter, said: Any, address: Address) -> Any:
        if not isinstance(said, dict):
            form = "`{mean: ..., deviation: ...}`, and `low` and `high` as you like"
            self._add(address, f"expected a mapping, got {show(said)}; write {form}")
            return None
        before = len(self.problems)
        found = self.parameters(_normal_parameters(number), said, address)
        low = -math.inf if number.minimum is None else number.minimum
        high = math.inf if number.maximum is None else number.maximum
        return self._made(Normal, before, address, {"low": low, "high": high, **found})

    def _choice(
        self, build: Callable[..., Any], values: Any, number: Parameter, said: Any, address: Address
    ) -> Any:
        before = len(self.problems)
        if not isinstance(said, dict):
            found = self.value(values, number, said, address)
            return self._made(build, before, address, {"values": found})
        doc = "what is chosen from"
        keys = {
            "values": Parameter(
                type=values,
                default=REQUIRED,
                unit=number.unit,
                minimum=number.minimum,
                maximum=number.maximum,
                doc=doc,
            ),
            "weights": Parameter(
                type=tuple[float, ...], default=(), doc="how likely each is, in proportion"
            ),
        }
        return self._made(build, before, address, self.parameters(keys, said, address))


def _number_of(parameter: Parameter) -> Parameter:
    """One number of a distributed parameter."""
    default = parameter.default
    return Parameter(
        type=float,
        unit=parameter.unit,
        default=default.value if isinstance(default, Constant) else REQUIRED,
        minimum=parameter.minimum,
        maximum=parameter.maximum,
        doc=parameter.doc,
    )


def _normal_parameters(number: Parameter) -> Mapping[str, Parameter]:
    """The keys of `normal`."""

    def value(doc: str, default: Any = REQUIRED) -> Parameter:
        return Parameter(
            type=float,
            unit=number.unit,
            default=default,
            minimum=number.minimum,
            maximum=number.maximum,
            doc=doc,
        )

    deviation = Parameter(
        type=float, unit=difference(number.unit), default=REQUIRED, doc="standard deviation"
    )
    return {
        "mean": value("without the bounds"),
        "deviation": deviation,
        "low": value("lower bound of draws", None),
        "high": value("upper bound of draws", None),
    }
