"""FMUs do for us, bit for bit, what they do for FMPy: every type, and the paths of their lives."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from adapters.fmi import FmuComponentType
from adapters.fmi.fmi3 import Fmi3Instance
from orchestrator.cli import main
from orchestrator.component import Component, RestorableComponent
from orchestrator.randomness import stream
from orchestrator.signal import Causality, Signal, Signals
from orchestrator.timebase import CommunicationGrid
from tests.adapters.fmu.peer import Peer

STEP = 100_000_000
COUNT = 6

Draw = Callable[[st.SearchStrategy[Any]], Any]


class Pair:
    """One FMU in both importers, told the same."""

    def __init__(self, path: Path, folder: Path, parameters: Mapping[str, Any]) -> None:
        self.ours = FmuComponentType(path).create("unit", parameters)
        self.theirs = Peer(path, folder)
        self.inputs = [
            name for name, c in self.ours.connectors.items() if c.causality is Causality.INPUT
        ]
        self.outputs = [name for name in self.ours.connectors if name not in self.inputs]
        self.parameters = parameters
        self.now = 0
        self._states: list[tuple[Any, Any, dict[str, int], int]] = []

    def start(self, inputs: Signals) -> None:
        lengths = self._lengths(inputs)
        chosen = {n: v for n, v in self.parameters.items() if n in self.theirs.lengths}
        self.theirs.configure(lengths | chosen)
        others = {n: v for n, v in self.parameters.items() if n not in chosen}
        self.theirs.set({n: np.asarray(v) for n, v in others.items()})
        self.theirs.begin(0.0, COUNT * STEP / 1e9)
        self.theirs.set(inputs)
        self.theirs.finish_beginning()
        self.ours.expect(CommunicationGrid(0, STEP, COUNT))
        self.ours.setup(0, stream(1, "unit"))
        self.ours.initialise(inputs)
        self.compare()

    def step(self, inputs: Signals) -> None:
        self.theirs.configure(self._lengths(inputs))
        self.theirs.set(inputs)
        self.theirs.step(self.now / 1e9, STEP / 1e9)
        self.ours.step(inputs, self.now, STEP)
        self.now += STEP
        self.compare()

    def save(self) -> None:
        assert isinstance(self.ours, RestorableComponent)
        theirs = self.theirs.fmu.getFMUState()
        self._states.append((self.ours.save(), theirs, dict(self.theirs.lengths), self.now))

    def restore(self, which: int) -> None:
        assert isinstance(self.ours, RestorableComponent)
        if not self._states:
            return
        ours, theirs, lengths, now = self._states[which % len(self._states)]
        self.ours.restore(ours)
        self.theirs.fmu.setFMUState(theirs)
        self.theirs.lengths, self.now = dict(lengths), now
        self.compare()

    def compare(self) -> None:
        found, expected = self.ours.outputs(), self.theirs.get(self.outputs)
        for name, value in found.items():
            other = expected[name]
            if isinstance(value, bytes) or isinstance(other, bytes):
                assert value == other, name
            else:
                assert (value.dtype, value.shape) == (other.dtype, other.shape), name
                assert value.tobytes() == other.tobytes(), name

    def _lengths(self, inputs: Signals) -> dict[str, int]:
        """Of the axes that follow inputs."""
        found = {}
        for name, value in inputs.items():
            if not isinstance(value, bytes):
                axes = self.theirs.variables[name].dimensions or ()
                for axis, length in zip(axes, value.shape, strict=True):
                    if axis.variable is not None and axis.variable.variability == "tunable":
                        found[axis.variable.name] = length
        return found

    def close(self) -> None:
        for _, state, _, _ in self._states:
            self.theirs.fmu.freeFMUState(state)
        self.theirs.close()
        self.ours.close()


@contextmanager
def pair(path: Path, folder: Path, **parameters: Any) -> Iterator[Pair]:
    made = Pair(path, folder, parameters)
    try:
        yield made
    finally:
        made.close()


def value_of(draw: Draw, component: Component, name: str, lengths: Mapping[str, int]) -> Signal:
    """Any value that an input may have, in the sizes of this point."""
    connector = component.connectors[name]
    if connector.is_text:
        letters = st.characters(codec="utf-8", exclude_characters="\0")
        text: str = draw(st.text(letters, max_size=15))
        return text.encode()
    if connector.is_binary:
        return bytes(draw(st.binary(max_size=20)))
    shape = tuple(n if isinstance(n, int) else lengths[n] for n in connector.shape)
    dtype = np.dtype(connector.dtype)
    elements: st.SearchStrategy[Any]
    if name.startswith("enumeration"):
        elements = st.integers(1, 3)
    elif dtype.kind == "f":
        elements = st.floats(
            allow_nan=False, allow_infinity=False, width=32 if dtype.itemsize == 4 else 64
        )
    elif dtype.kind == "b":
        elements = st.booleans()
    else:
        bounds = np.iinfo(dtype)
        elements = st.integers(int(bounds.min), int(bounds.max))
    count = int(np.prod(shape, dtype=int))
    return np.array(draw(st.lists(elements, min_size=count, max_size=count)), dtype).reshape(shape)


ACTIONS = st.sampled_from(["step", "step", "step", "save", "restore"])


@pytest.mark.slow
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
@pytest.mark.parametrize(
    ("unit", "parameters"),
    [
        ("echo", {}),
        ("mirror", {}),
        ("matrix", {"gain": -2.5, "n_spare": 5}),
        ("lag", {"n_channel": 3, "time_constant": 0.7, "initial": -1.0, "seed": 4}),
        ("table", {"n_sample": 3, "sample.gain": (1.0, -2.0, 0.5)}),
        ("lag2", {"time_constant": 0.3}),
        ("product2", {}),
    ],
)
def test_a_life(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    unit: str,
    parameters: dict[str, Any],
    data: st.DataObject,
) -> None:
    """Random inputs and sizes, states stored and returned to, in any order."""
    is_ours = unit not in {"lag2", "product2"}
    built = request.getfixturevalue("fmu" if is_ours else unit)
    path = built(unit) if is_ours else built
    with pair(path, tmp_path_factory.mktemp("peer"), **parameters) as both:
        axes = {
            axis
            for name in both.inputs
            for axis in both.ours.connectors[name].shape
            if isinstance(axis, str)
        }
        own = {name.removeprefix("n_"): n for name, n in parameters.items()}

        earlier: list[dict[str, Signal]] = []

        def inputs() -> Signals:
            """New values, the same objects as at an earlier point, or some of both."""
            lengths = {axis: own.get(axis) or data.draw(st.integers(0, 4)) for axis in axes}
            found = {n: value_of(data.draw, both.ours, n, lengths) for n in both.inputs}
            before = data.draw(st.sampled_from([{}, *earlier]))
            if before:
                kept = data.draw(st.sets(st.sampled_from(both.inputs)))
                is_same_size = all(np.shape(before[n]) == np.shape(found[n]) for n in found)
                found |= {n: before[n] for n in (kept if is_same_size else found)}
            earlier.append(found)
            return found

        both.start(inputs())
        for action in data.draw(st.lists(ACTIONS, min_size=1, max_size=COUNT)):
            if action == "step":
                both.step(inputs())
            elif action == "save":
                both.save()
            else:
                both.restore(data.draw(st.integers(0, 9)))


def test_what_is_set_again_after_a_return(fmu: Callable[[str], Path], tmp_path: Path) -> None:
    """The state before knows other inputs and other sizes than the last step did."""
    with pair(fmu("matrix"), tmp_path / "peer") as both:
        short, long, other = (np.full((n, 4), x) for n, x in ((2, 1.5), (3, 2.5), (2, 3.5)))
        both.start({"row.value": short})
        both.step({"row.value": short})
        both.save()
        for last in (long, other):
            both.step({"row.value": last})
            both.restore(0)
            both.step({"row.value": last})  # the same object as the last one that was set
            both.restore(0)


class Overheard:
    """The calls of every FMU of a run, in their order, by the path of the FMU."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls: defaultdict[tuple[Path, int], list[tuple[str, Any]]] = defaultdict(list)
        self._is_inside = False
        for name in ("configure", "write", "enter_initialisation", "exit_initialisation"):
            self._listen(monkeypatch, name)
        for name in ("step", "read"):
            self._listen(monkeypatch, name)

    def _listen(self, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        called = getattr(Fmi3Instance, name)

        def listened(instance: Any, *arguments: Any, **options: Any) -> Any:
            is_inner, self._is_inside = self._is_inside, True
            try:
                found = called(instance, *arguments, **options)
            finally:
                self._is_inside = is_inner
            if not is_inner:
                given = [dict(a) if isinstance(a, Mapping) else a for a in arguments]
                key = instance._description.path, id(instance)
                self.calls[key].append((name, found if name == "read" else given))
            return found

        monkeypatch.setattr(Fmi3Instance, name, listened)


def replay(calls: list[tuple[str, Any]], peer: Peer) -> int:
    """Make the calls through FMPy; how many outputs were compared."""
    compared = 0
    for name, said in calls:
        if name == "configure":
            peer.configure(*said)
        elif name == "write":
            peer.set(*said)
        elif name == "enter_initialisation":
            peer.begin(said[0], None)
        elif name == "exit_initialisation":
            peer.finish_beginning()
        elif name == "step":
            peer.step(*said)
        else:
            for output, value in peer.get(list(said)).items():
                ours = said[output]
                if isinstance(ours, bytes):
                    assert ours == value, output
                else:
                    assert ours.tobytes() == np.asarray(value).tobytes(), output
                compared += 1
    return compared


@pytest.mark.slow
def test_the_units_of_the_study_in_a_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Channel, lidar and perception get what they get in the red light, and give the same."""
    heard = Overheard(monkeypatch)
    assert (
        main(
            [
                "run",
                "red_light",
                "--set",
                "time.stop=0.6s",
                "--out",
                str(tmp_path / "run"),
                "--quiet",
            ]
        )
        == 0
    )
    assert len(heard.calls) == 3
    for index, ((path, _), calls) in enumerate(heard.calls.items()):
        peer = Peer(path, tmp_path / f"peer{index}")
        assert replay(calls, peer) >= 7  # outputs at every step
        peer.close()
