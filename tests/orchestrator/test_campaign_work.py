"""A run of a campaign in a process of its own, and what is done about one that fails."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from orchestrator import scratch as temporary
from orchestrator.campaign import workers
from orchestrator.campaign.work import Result, RunKey, Work, _alone, _folder, perform
from orchestrator.campaign.workers import DaskWorkers

MODULE = """\
import numpy as np
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector

class Ramp(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT)}
    def setup(self, start, rng):
        self.y = float(rng.random())
    def step(self, inputs, t, h):
        self.y += 1.0
    def outputs(self):
        return {"y": np.array(self.y)}
"""

SCENARIO = """\
schema: 1
title: A ramp
time: {stop: 100 ms}
components:
  ramp: {type: "ramp.py:Ramp", step: 10 ms}
"""


def test_a_process_of_its_own_gives_the_result_of_this_one(tmp_path: Path) -> None:
    (tmp_path / "ramp.py").write_text(MODULE)
    path = tmp_path / "ramp.yaml"
    path.write_text(SCENARIO)
    work = Work(scenario=str(path), overrides=("seed=3",), keep=None, scratch=None)
    here, there = perform(work), _alone(work)
    assert here.error is None
    assert here.fingerprint is not None
    assert (there.fingerprint, there.metrics, there.error) == (here.fingerprint, here.metrics, None)


@dataclass(frozen=True, eq=False)
class Future:
    """A run that is done."""

    found: Result
    status: str = "finished"

    def result(self) -> Result:
        return self.found


class Futures:
    """A client of Dask whose runs succeed or fail as told, in the order in which they are given."""

    def __init__(self, errors: Sequence[str | None]) -> None:
        self.errors, self.given, self.cancelled = list(errors), list[Work](), list[Any]()

    def map(self, _: Callable[..., Any], work: Sequence[Work], *, pure: bool) -> Sequence[Any]:
        assert not pure
        self.given += work
        return [self._future(self.errors.pop(0)) for _ in work]

    def _future(self, error: str | None) -> Future:
        fingerprint = "f" if error is None else None
        return Future(Result(wall=1.0, fingerprint=fingerprint, metrics={}, error=error))

    def cancel(self, futures: Sequence[Any], *, force: bool) -> None:
        assert force
        self.cancelled += futures

    def as_completed(self, futures: Sequence[Any]) -> "Completed":
        return Completed(list(futures))


class Completed(list[Any]):
    """Futures that are all done."""

    add = list.append


@pytest.mark.parametrize(
    ("errors", "given", "last"),
    [
        ([None], 1, None),
        (["a"], 2, None),
        (["a", "b"], 2, "b"),  # a second failure is the result
    ],
)
def test_what_fails_is_tried_a_second_time_and_no_third(
    monkeypatch: pytest.MonkeyPatch, errors: list[str | None], given: int, last: str | None
) -> None:
    client = Futures([*errors, None, None])
    monkeypatch.setattr(workers, "require", lambda _: client)
    work = Work(scenario="s", overrides=(), keep=None, scratch=None)
    (found,) = DaskWorkers(client, Path("there")).results([(RunKey(1, 0), work)])
    assert found[0] == RunKey(1, 0)
    assert found[1].error == last
    assert len(client.given) == given
    assert all(each.scratch == "there" for each in client.given)
    assert client.cancelled == []


def test_a_run_of_which_nothing_is_kept_is_where_one_says_or_is_swept(tmp_path: Path) -> None:
    with _folder(str(tmp_path)) as folder:
        assert (folder.parent, folder.is_dir()) == (tmp_path, True)
    with _folder(None) as other, temporary.scratch("beside") as beside:
        assert (other.parent, other.is_dir()) == (beside.parent, True)
    assert not any(each.exists() for each in (folder, other))
