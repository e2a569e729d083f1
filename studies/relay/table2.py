"""Table II: packet reception rate and relay switches of every method, and the regret."""

from typing import Any, Final

from orchestrator.intervals import share
from studies.method.estimates import columns, differences, estimate
from studies.relay.paper import TABLE_2
from studies.relay.sample import METHOD, Condition, Study

ORACLE: Final = "oracle"
"""The method that the others' regret is measured by."""


def rows(study: Study, condition: Condition) -> list[dict[str, Any]]:
    """One row per method.

    `runs` did not fail; `n` of them have a packet reception rate. The regret is the oracle's rate
    minus the method's, over the seeds that both have, `regret_n` of them. Numbers of the paper, in
    columns `paper_*`, belong to its average over densities that it does not name.
    """
    return [_row(study, method, condition) for method in study.methods(condition)]


def all_rows(study: Study) -> list[dict[str, Any]]:
    """The same at every condition, with a column per factor."""
    found = []
    for condition in study.conditions:
        for row in rows(study, condition):
            del row["paper_prr"], row["paper_relay_switches"]
            found.append({METHOD: row.pop(METHOD), **condition, **row})
    return found


def _row(study: Study, method: str, condition: Condition) -> dict[str, Any]:
    prr = study.sample("prr", method, condition)
    switches = study.sample("relay_switches", method, condition)
    regret = differences(study.sample("prr", ORACLE, condition), prr)
    paper = TABLE_2.get(method)
    return {
        METHOD: method,
        "runs": len(study.rows(method, condition)),
        "n": len(prr),
        **columns("prr", estimate(list(prr.values()))),
        "paper_prr": None if paper is None else paper.prr,
        **columns("relay_switches", estimate(list(switches.values()))),
        "paper_relay_switches": None if paper is None else paper.relay_switches,
        **columns("regret", estimate(regret)),
        "regret_n": len(regret),
        **_collisions(study, method, condition),
    }


def _collisions(study: Study, method: str, condition: Condition) -> dict[str, Any]:
    """The share of runs with a collision (interval of Wilson), if the experiment counts them."""
    if "collision_rate" not in study.results.experiment.metrics:
        return {}
    found = [row["collision_rate"] for row in study.rows(method, condition)]
    happened = [bool(value) for value in found if value is not None]
    return columns("collision_rate", share(happened) if happened else None)
