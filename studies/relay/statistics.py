"""Every table of the study: Table II, differences of methods, points of Figures 7 and 8.

All methods meet the same traffic and the same fading (common random numbers), so differences are
taken run by run with the same seed. They vary less than the rates themselves, and are known better
than two intervals side by side suggest.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.intervals import Estimate
from studies.method.estimates import differences, mean_of, percent, share_of
from studies.relay.conditions import (
    DENSITY,
    METHOD,
    ORACLE,
    Condition,
    vehicles_per_km,
)
from studies.relay.published import TABLE_2
from studies.relay.runs import Study


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What the runs of a method under a condition say: a row of Table II.

    Attributes:
        method: the level of the factor `method`.
        condition: the levels of the other factors.
        runs: the number of runs that did not fail.
        n: the number of those that have a packet reception rate.
        prr: mean packet reception rate, 0 to 1.
        paper_prr: that of the paper, which averages over densities that it does not name.
        relay_switches: mean number of changes of the relay in a run.
        paper_relay_switches: that of the paper.
        regret: mean of the oracle's packet reception rate minus the method's, by seed.
        regret_n: the number of seeds that both have.
        collision_rate: the share of runs with a collision, if the experiment counts them.
    """

    method: str
    condition: Condition
    runs: int
    n: int
    prr: Estimate | None
    paper_prr: float | None = None
    relay_switches: Estimate | None
    paper_relay_switches: float | None = None
    regret: Estimate | None
    regret_n: int
    collision_rate: Estimate | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """How two methods differ under a condition, by the same seeds.

    Attributes:
        condition: the levels of the factors but the method.
        a: the first method.
        b: the second method.
        n: the number of seeds that both have.
        difference: packet reception rate of `a` minus that of `b` [points].
        a_better: the share of the seeds in which `a` delivers more, 0 to 1.
        b_better: the share of the seeds in which `b` does; both are equal in the others.
    """

    condition: Condition
    a: str
    b: str
    n: int
    difference: Estimate | None
    a_better: float | None
    b_better: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DensityPoint:
    """A point of Figure 7: packet reception rate over the density of traffic.

    Attributes:
        method: the level of the factor `method`.
        condition: the levels of the other factors.
        vehicles_per_km: vehicles per km and lane [1/km].
        n: the number of runs that have a packet reception rate.
        prr: mean packet reception rate, 0 to 1.
    """

    method: str
    condition: Condition
    vehicles_per_km: float
    n: int
    prr: Estimate | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A step of Figure 8: of the distribution function of the packet reception rate over runs.

    Attributes:
        method: the level of the factor `method`.
        n: the number of runs.
        prr: packet reception rate, 0 to 1.
        share: the share of runs with at most that, 0 to 1.
        share_low, share_high: the band around the whole function, 0 to 1.
    """

    method: str
    n: int
    prr: float
    share: float
    share_low: float
    share_high: float


def results(study: Study, conditions: Sequence[Condition]) -> list[Result]:
    """Table II under every one of `conditions`."""
    return [
        _result(study, method, condition)
        for condition in conditions
        for method in study.methods(condition)
    ]


def pairs(study: Study) -> list[Pair]:
    """The differences of all pairs of methods under all conditions."""
    return [
        _pair(study, condition, a, b)
        for condition in study.conditions
        for a, b in itertools.combinations(study.methods(condition), 2)
    ]


def density_points(study: Study) -> list[DensityPoint]:
    """The points by method and density, all other factors at their base levels."""
    rest = {factor: level for factor, level in study.base.items() if factor != DENSITY}
    along = [
        condition
        for condition in study.conditions
        if all(condition[factor] == level for factor, level in rest.items())
    ]
    found = []
    for method in study.results.experiment.levels[METHOD]:
        points = [
            _density_point(study, method, condition)
            for condition in along
            if method in study.methods(condition)
        ]
        found += sorted(points, key=lambda point: point.vehicles_per_km)
    return found


def steps(study: Study) -> list[Step]:
    """The steps of the empirical distribution function of every method, at the base condition."""
    found = []
    for method in study.methods(study.base):
        values = sorted(study.sample("prr", method, study.base).values())
        n = len(values)
        for value in sorted(set(values)):
            share = sum(each <= value for each in values) / n
            found.append(
                Step(
                    method=method,
                    n=n,
                    prr=value,
                    share=share,
                    share_low=max(0.0, share - band(n)),
                    share_high=min(1.0, share + band(n)),
                )
            )
    return found


def band(n: int) -> float:
    r"""Half the height of a band that covers the whole distribution function with 95 %.

    $$ \epsilon = \sqrt{\ln(2 / 0.05) / (2 n)} $$

    Dvoretzky, Kiefer and Wolfowitz with Massart's constant (Annals of Probability 18(3), 1990), for
    n independent runs.
    """
    return math.sqrt(math.log(2.0 / 0.05) / (2.0 * n))


def _result(study: Study, method: str, condition: Condition) -> Result:
    prr = study.sample("prr", method, condition)
    switches = study.sample("relay_switches", method, condition)
    regret = differences(study.sample("prr", ORACLE, condition), prr)
    paper = TABLE_2.get(method)
    return Result(
        method=method,
        condition=condition,
        runs=len(study.rows(method, condition)),
        n=len(prr),
        prr=mean_of(list(prr.values())),
        paper_prr=None if paper is None else paper.prr,
        relay_switches=mean_of(list(switches.values())),
        paper_relay_switches=None if paper is None else paper.relay_switches,
        regret=mean_of(regret),
        regret_n=len(regret),
        collision_rate=_collision_rate(study, method, condition),
    )


def _collision_rate(study: Study, method: str, condition: Condition) -> Estimate | None:
    found = [row.get("collision_rate") for row in study.rows(method, condition)]
    return share_of([bool(value) for value in found if value is not None])


def _pair(study: Study, condition: Condition, a: str, b: str) -> Pair:
    found = differences(study.sample("prr", a, condition), study.sample("prr", b, condition))
    n = len(found)
    return Pair(
        condition=condition,
        a=a,
        b=b,
        n=n,
        difference=percent(mean_of(found)),
        a_better=sum(value > 0.0 for value in found) / n if n else None,
        b_better=sum(value < 0.0 for value in found) / n if n else None,
    )


def _density_point(study: Study, method: str, condition: Condition) -> DensityPoint:
    levels = {METHOD: method, **condition}
    (scenario,) = (
        one.resolved for one in study.results.experiment.combinations if one.levels == levels
    )
    sample = study.sample("prr", method, condition)
    return DensityPoint(
        method=method,
        condition=condition,
        vehicles_per_km=vehicles_per_km(scenario),
        n=len(sample),
        prr=mean_of(list(sample.values())),
    )
