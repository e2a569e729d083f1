"""A run that goes on from a checkpoint is the run that nobody cut off: bytes, results, counts."""

import logging
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.adaptive import Adaptive
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.capabilities import PortableState
from orchestrator.component import Component, DecidingComponent
from orchestrator.errors import ComponentError
from orchestrator.recording import parts
from orchestrator.recording.recorder import Recorder
from orchestrator.resuming.continuation import continuation_of, told
from orchestrator.resuming.files import CheckpointError, checkpoints_of
from orchestrator.resuming.keeper import Keeper
from orchestrator.resuming.manners import manners_of
from orchestrator.signal import Causality, Connector
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import StepSize
from tests.orchestrator.linear_parts import EVERYTHING, Linear
from tests.orchestrator.mechanics import two_masses
from tests.orchestrator.resumable import (
    MS,
    Cut,
    Noise,
    S,
    contents,
    cut_and_resumed,
    interrupted,
    link,
    one,
    run,
)


def coupled(kinds: frozenset[type], *, are_portable: bool) -> System:
    """Two masses that depend on each other, and noise of three rates that reads them, late too."""
    network = two_masses()
    own = kinds | ({PortableState} if are_portable else set())
    components: dict[str, Component] = {
        name: Linear(part, own) for name, part in network.parts.items()
    }
    components |= {"slow": Noise(is_portable=True), "fast": Noise(), "odd": Noise(is_portable=True)}
    sizes: dict[str, StepSize] = dict.fromkeys(components, 10 * MS)
    sizes |= {"slow": 20 * MS, "odd": Fraction(S, 60)}
    links = [
        link("left.x", "right.x"),
        link("left.v", "right.v"),
        link("right.f", "left.f"),
        link("left.x", "slow.u", gain=0.3),
        link("slow.y", "fast.u", sample=40 * MS),
        link("odd.y", "fast.late", delay=30 * MS),
        link("fast.y", "odd.u"),
        link("right.y", "odd.late", delay=20 * MS, gain=2.0),
    ]
    return System(components, sizes, links)


def of_all(kinds: frozenset[type]) -> Callable[[], System]:
    return lambda: coupled(kinds, are_portable=True)


def of_some(kinds: frozenset[type]) -> Callable[[], System]:
    return lambda: coupled(kinds, are_portable=False)


ALGORITHMS: dict[str, CosimulationAlgorithm] = {
    "jacobi": Jacobi(),
    "jacobi-quadratic": Jacobi(extrapolation="quadratic", smooth=True),
    "gauss-seidel": GaussSeidel(("left", "right", "fast", "slow", "odd")),
    "gauss-seidel-linear": GaussSeidel(
        ("left", "right", "slow", "fast", "odd"), extrapolation="linear", smooth=True
    ),
    "fixed-point": FixedPoint(),
    "fixed-point-linear": FixedPoint(interpolation="linear"),
    "quasi-newton": InterfaceQuasiNewton(interpolation="quadratic"),
    "adaptive": Adaptive(relative_tolerance=1e-4),
}


@pytest.mark.slow
@pytest.mark.parametrize("kinds", [frozenset[type](), EVERYTHING], ids=["held", "following"])
@pytest.mark.parametrize("made", [of_all, of_some], ids=["restored", "replayed"])
@pytest.mark.parametrize("name", ALGORITHMS)
def test_the_rest_of_the_run_is_the_same(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    made: Callable[[frozenset[type]], Callable[[], System]],
    kinds: frozenset[type],
) -> None:
    """Checkpoints come every 100 ms, where 10 ms, 20 ms and 1/60 s meet; blocks end anywhere."""
    algorithm = ALGORITHMS[name]
    if name == "adaptive":
        kinds = EVERYTHING
    monkeypatch.setattr(parts, "BLOCK_BYTES", 300)
    system = made(kinds)
    whole, result = run(tmp_path / "whole", system(), algorithm, S, every=10 * S)
    found, fingerprint, again = cut_and_resumed(
        tmp_path / "cut", system, algorithm, S, every=100 * MS, cut=730 * MS
    )
    assert found.time == 700 * MS
    assert fingerprint == whole
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")
    assert again.coupling == result.coupling
    for component, values in result.values.items():
        for connector, value in values.items():
            assert np.array_equal(again.values[component][connector], value)


def test_only_what_cannot_save_its_state_steps_again(tmp_path: Path) -> None:
    made: list[System] = []

    def system() -> System:
        components = {"a": Noise(), "b": Noise(is_portable=True)}
        wires = [link("a.y", "b.u"), link("b.y", "a.u")]
        made.append(System(dict(components), dict.fromkeys(components, 10 * MS), wires))
        return made[-1]

    found, _, _ = cut_and_resumed(tmp_path, system, Jacobi(), S, every=200 * MS, cut=810 * MS)
    steps = {name: each.steps for name, each in made[1].components.items()}  # type: ignore[attr-defined]
    assert steps == {"a": 100, "b": 20}
    assert list(told(found)) == [
        "the run goes on at t = 0.8 s: `b` restored; 80 steps of `a` made again"
    ]


def test_a_run_is_gone_on_with_again_and_again(tmp_path: Path) -> None:
    """Each time it is cut off a little later, once before it has written a checkpoint."""
    whole, _ = run(tmp_path / "whole", coupled(EVERYTHING, are_portable=False), Jacobi(), S,
                   every=10 * S)  # fmt: skip
    folder, found = tmp_path / "cut", None
    for cut in (230, 260, 510, 870):
        with pytest.raises(KeyboardInterrupt):
            run(folder, coupled(EVERYTHING, are_portable=False), Jacobi(), S, every=100 * MS,
                cut=cut * MS, continuation=found)  # fmt: skip
        found = continuation_of(folder, {})
        assert found.time == cut // 100 * 100 * MS
    fingerprint, _ = run(folder, coupled(EVERYTHING, are_portable=False), Jacobi(), S,
                         every=100 * MS, continuation=found)  # fmt: skip
    assert fingerprint == whole
    assert contents(folder) == contents(tmp_path / "whole")


class Forgetful(Noise):
    """Says something else in every run."""

    runs = 0

    @override
    def setup(self, start: int, rng: np.random.Generator) -> None:
        Forgetful.runs += 1
        super().setup(start, np.random.default_rng(Forgetful.runs))


def test_who_does_not_step_as_before_is_named(tmp_path: Path) -> None:
    def system() -> System:
        components: dict[str, Component] = {"a": Forgetful(), "b": Noise(is_portable=True)}
        return System(components, dict.fromkeys(components, 10 * MS), [])

    what = "`a` at t = 0.5 s: stepped again to another state than before: it depends on more"
    with pytest.raises(ComponentError, match=what):
        cut_and_resumed(tmp_path, system, Jacobi(), S, every=100 * MS, cut=550 * MS)


class Careless(Noise):
    """Takes nothing up again."""

    @override
    def load(self, content: bytes) -> None:
        pass


class Wordy(Noise):
    """Has a text for its state."""

    @override
    def dump(self) -> bytes:
        return super().dump().decode()  # type: ignore[return-value]


def test_who_does_not_come_back_as_before_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def system() -> System:
        components: dict[str, Component] = {
            "a": Careless(is_portable=True),
            "b": Noise(is_portable=True),
        }
        return System(components, dict.fromkeys(components, 10 * MS), [])

    with caplog.at_level(logging.WARNING):
        cut_and_resumed(tmp_path, system, Jacobi(), S, every=100 * MS, cut=550 * MS)
    (told_,) = [r.getMessage() for r in caplog.records if "than before" in r.getMessage()]
    assert told_.startswith("component `a` came to other outputs than before: `load` does not")


def test_a_state_that_is_no_bytes_is_refused_when_it_is_saved(tmp_path: Path) -> None:
    system = System({"a": Wordy(is_portable=True)}, {"a": 10 * MS}, [])
    what = "`a` at t = 0.1 s: while saving its state: `dump` gave `str`, not bytes"
    with pytest.raises(ComponentError, match=what):
        run(tmp_path, system, Jacobi(), S, every=100 * MS)


def test_wall_time_is_that_of_both_runs(tmp_path: Path) -> None:
    _, _, result = cut_and_resumed(tmp_path, one, Jacobi(), S, every=100 * MS, cut=550 * MS)
    assert result.wall_time.orchestrator > 0
    assert result.wall_time.observers > 0


def test_a_checkpoint_of_other_manners_is_refused(tmp_path: Path) -> None:
    """As where the transport is another one, and somebody cannot save the state there."""
    interrupted(tmp_path)
    before = contents(tmp_path)
    found = continuation_of(tmp_path, {})
    what = "t = 0.5 s cannot be used here: no component can save its state; .*--from-start"
    with pytest.raises(CheckpointError, match=what):
        run(
            tmp_path,
            one(is_portable=False),
            Jacobi(),
            S,
            every=100 * MS,
            continuation=found,
        )
    assert {name: len(each) for name, each in before.items()}.keys() >= contents(tmp_path).keys()
    assert continuation_of(tmp_path, {}).time == 500 * MS


class Impatient(Cut):
    """Wants the run to end while steps are made again."""

    def __init__(self, after: int) -> None:
        super().__init__(S)
        self._left = after

    @override
    def look_up(self) -> None:
        self._left -= 1
        if self._left == 0:
            raise KeyboardInterrupt


def test_a_request_is_heard_while_steps_are_made_again(tmp_path: Path) -> None:
    made: list[Noise] = []

    def system() -> System:
        made.append(Noise())
        components: dict[str, Component] = {"a": made[-1], "b": Noise(is_portable=True)}
        return System(components, dict.fromkeys(components, 10 * MS), [])

    whole, _ = run(tmp_path / "whole", system(), Jacobi(), S, every=10 * S)
    folder = tmp_path / "cut"
    with pytest.raises(KeyboardInterrupt):
        run(folder, system(), Jacobi(), S, every=100 * MS, cut=550 * MS)
    for _ in range(2):
        found = continuation_of(folder, {})
        assert found.time == 500 * MS
        found.clear()
        recorder = Recorder(folder, again=found.again)
        keeper = Keeper(folder, 100 * MS, recorder, found.found)
        with pytest.raises(KeyboardInterrupt):
            simulate(
                system(),
                Jacobi(),
                start=0,
                stop=S,
                seed=3,
                observers=[recorder, Impatient(20)],
                checkpoints=keeper,
            )
        assert made[-1].steps == 19
    found = continuation_of(folder, {})
    fingerprint, _ = run(folder, system(), Jacobi(), S, every=100 * MS, continuation=found)
    assert fingerprint == whole
    assert contents(folder) == contents(tmp_path / "whole")


def test_who_cannot_save_states_has_no_checkpoints(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level("INFO"), pytest.raises(KeyboardInterrupt):
        run(tmp_path, one(is_portable=False), Jacobi(), S, every=100 * MS, cut=550 * MS)
    assert checkpoints_of(tmp_path) == ()
    assert "no checkpoints: no component can save its state" in caplog.text


class Undecided(Noise, DecidingComponent):
    """Has nothing to decide, but might."""

    decision = None

    @override
    def decide(self, alternative: int) -> None:
        pass

    @override
    def score(self) -> float:
        return 0.0


class Objects(Noise):
    """Hands out Python objects."""

    connectors: Mapping[str, Connector] = {
        **Noise.connectors,
        "what": Connector(causality=Causality.OUTPUT, dtype=np.object_),
    }


class Secretive(Jacobi):
    """An algorithm of somebody else, which keeps what it does not tell."""

    @override
    def memory(self) -> None:
        return None


@pytest.mark.parametrize(
    ("component", "algorithm", "reason"),
    [
        (Undecided, Jacobi(), "alternatives of `a` are tried in copies of the run"),
        (Objects, Jacobi(), "Python objects are exchanged by `a`"),
        (Noise, Secretive(), "the coupling algorithm cannot tell what it knows of the run"),
    ],
)
def test_why_there_are_no_checkpoints_is_said(
    component: type[Noise], algorithm: CosimulationAlgorithm, reason: str
) -> None:
    system = System({"a": component(is_portable=True)}, {"a": 10 * MS}, [])
    found = manners_of(system, knows_itself=algorithm.memory() is not None)
    said = f"no checkpoints: {reason}; a resumed run steps again from its start"
    assert list(found.lines()) == [said]
