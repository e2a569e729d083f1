"""The claims about relay policies, on runs that we chose."""

from collections.abc import Callable, Mapping

import pytest

from studies.method.claims import judge
from studies.relay.claims import claims
from studies.relay.runs import Study
from tests.studies.relay.synthetic import experiment, run
from tests.studies.results import results

Rate = Callable[[int], Mapping[str, object]]


def verdicts(runs: Mapping[str, Rate]) -> dict[str, str]:
    """Of every claim."""
    plan = experiment(tuple(runs), seeds=4)
    found = results(plan, lambda levels, seed: runs[levels["method"]](seed))
    judgements = judge(claims(Study(found, {"density": "30 m"})))
    return {one.claim: one.verdict for one in judgements}


def constant(prr: float, switches: int) -> Rate:
    """The same in every run."""
    return lambda _: run(prr, switches=switches)


PAPER: dict[str, Rate] = {
    "mohed": constant(0.88, 2),
    "signal-strength": constant(0.47, 3),
    "random": constant(0.51, 4),
    "direct": lambda seed: run(0.39, direct=0.392 + 0.001 * (seed % 2)),
    "expected-prr": constant(0.90, 1),
    "oracle": constant(0.92, 1),
}
"""The numbers of the paper, and what we expect of the methods that it does not have."""

OPPOSITE: dict[str, Rate] = PAPER | {
    "mohed": constant(0.40, 4),
    "signal-strength": constant(0.60, 3),
    "random": constant(0.50, 3),
    "direct": lambda _: run(0.8, direct=0.8),
    "expected-prr": constant(0.60, 1),
}


@pytest.mark.parametrize(("runs", "verdict"), [(PAPER, "reproduced"), (OPPOSITE, "not reproduced")])
def test_the_numbers_of_the_paper_reproduce_its_claims_and_the_opposite_refutes_them(
    runs: Mapping[str, Rate], verdict: str
) -> None:
    assert set(verdicts(runs).values()) == {verdict}


def test_better_than_one_rival_is_a_part_of_the_claim() -> None:
    found = verdicts(
        {
            "mohed": constant(0.80, 2),
            "signal-strength": constant(0.70, 2),
            "random": constant(0.50, 3),
        }
    )
    assert found["mohed-better"] == "reproduced"
    assert found["mohed-25-points"] == "partly reproduced"
    assert found["mohed-fewer-switches"] == "partly reproduced"  # equal is not fewer
    assert found["signal-strength-not-better"] == "not reproduced"
    assert found["direct-link"] == found["improved-near-oracle"] == "undecided"  # were not run


def test_differences_decide_where_rates_vary_with_the_traffic() -> None:
    """The rates spread over 40 points, and every difference is about 26."""
    found = verdicts(
        {
            "mohed": lambda seed: run(0.3 + 0.1 * seed + 0.26 + 0.001 * (seed % 2)),
            "signal-strength": constant(0.0, 0),
            "random": lambda seed: run(0.3 + 0.1 * seed),
        }
    )
    assert found["mohed-25-points"] == "reproduced"


def test_the_paper_stands_beside_every_comparison_that_it_has() -> None:
    plan = experiment(("mohed", "signal-strength", "random"))
    judgements = judge(claims(Study(results(plan, lambda *_: run(0.5)), {"density": "30 m"})))
    paper = {one.quantity: one.paper for one in judgements}
    assert paper["PRR of mohed minus signal-strength"] == pytest.approx(41.39)
    assert paper["relay switches of mohed minus random"] == pytest.approx(-0.9)
    assert paper["PER of the direct link"] == pytest.approx(60.78)
    assert paper["PRR of oracle minus expected-prr"] is None
