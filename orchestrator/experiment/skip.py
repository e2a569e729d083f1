"""Leaving combinations of levels out: what the rules mean, and what is wrong with them."""

import itertools
from collections.abc import Iterator, Mapping, Sequence

from orchestrator.scenario.document import Address
from orchestrator.suggestion import suggestion

Rule = Mapping[str, Sequence[str]]
"""Matches the combinations that have, of every factor in it, one of the levels."""
Factors = Mapping[str, Sequence[str]]
"""The levels of every factor."""


def combinations(factors: Factors, rules: Sequence[Rule]) -> list[Mapping[str, str]]:
    """The levels of every combination that no rule matches; the last factor varies fastest."""
    return [levels for levels in _all(factors) if not any(_matches(r, levels) for r in rules)]


def problems(factors: Factors, rules: Sequence[Rule]) -> Iterator[tuple[Address, str, bool]]:
    """What is wrong with the rules: where, what, and whether a key is at fault."""
    is_sound = True
    for index, rule in enumerate(rules):
        for found in _unknown(factors, rule, ("skip", index)):
            is_sound = False
            yield found
    if is_sound:
        yield from _without_effect(factors, rules)


def _unknown(factors: Factors, rule: Rule, address: Address) -> Iterator[tuple[Address, str, bool]]:
    for factor, levels in rule.items():
        if factor not in factors:
            what = f"there is no factor `{factor}`; {suggestion(factor, factors)}"
            yield (*address, factor), what, True
            continue
        for number, level in enumerate(levels):
            if level not in factors[factor]:
                hint = suggestion(level, factors[factor])
                what = f"the factor `{factor}` has no level `{level}`; {hint}"
                yield (*address, factor, number), what, False


def _without_effect(factors: Factors, rules: Sequence[Rule]) -> Iterator[tuple[Address, str, bool]]:
    left = list(_all(factors))
    for index, rule in enumerate(rules):
        after = [levels for levels in left if not _matches(rule, levels)]
        if not after:
            yield ("skip", index), "leaves nothing to run", False
            return
        if len(after) == len(left):
            what = "the rules before it leave out all that this one matches; remove it"
            yield ("skip", index), what, False
        left = after


def _matches(rule: Rule, levels: Mapping[str, str]) -> bool:
    return all(levels[factor] in wanted for factor, wanted in rule.items())


def _all(factors: Factors) -> Iterator[Mapping[str, str]]:
    for choice in itertools.product(*factors.values()):
        yield dict(zip(factors, choice, strict=True))
