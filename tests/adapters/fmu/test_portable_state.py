"""States of FMUs as bytes: another instance goes on from them, in any process."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.signal import Signal, Signals

S = 1_000_000_000
BILINEAR: Mapping[str, Signal] = {
    "u": np.array([2.0, 3.0]),
    "p": np.array(5.0),
    "q": np.array(7.0),
}
PRODUCT: Mapping[str, Signal] = {"a": np.array(2.0), "b": np.array(3.0), "said": b"all"}


def begun(path: Path, inputs: Signals, **values: object) -> Component:
    component = FmuComponentType(path).create("unit", values)
    component.setup(0, np.random.default_rng(1))
    component.initialise(inputs)
    return component


def portable(component: Component) -> PortableState:
    found = component.capability(PortableState)  # type: ignore[type-abstract]
    assert found is not None
    return found


def test_another_instance_goes_on_from_it(bilinear3: Path) -> None:
    first = begun(bilinear3, BILINEAR)
    first.step({**BILINEAR, "p": np.array(11.0)}, 0, S)
    content = portable(first).dump()
    first.step(BILINEAR, S, S)
    second = begun(bilinear3, BILINEAR)
    portable(second).load(content)
    outputs = second.outputs()
    assert float(outputs["sum"]) == 11
    assert np.array_equal(outputs["y"], [22, 33, 6])  # of the inputs of that step
    second.step(BILINEAR, S, S)
    assert second.outputs().keys() == first.outputs().keys()
    for name, value in first.outputs().items():
        assert np.array_equal(second.outputs()[name], value)
    first.close()
    second.close()


def test_texts_and_fmi_2(product2: Path) -> None:
    first = begun(product2, PRODUCT, prefix="heard it ")
    content = portable(first).dump()
    first.close()
    second = begun(product2, {**PRODUCT, "said": b"nothing", "a": np.array(9.0)})
    portable(second).load(content)
    assert second.outputs()["heard"] == b"heard it all"
    second.step({**PRODUCT, "b": np.array(10.0)}, 0, S)
    assert np.array_equal(second.outputs()["y"], 20)
    second.close()


def test_sizes_are_part_of_it(fmu: Callable[[str], Path]) -> None:
    """Of an FMU whose arrays are as long as its inputs."""
    path = fmu("matrix")
    wide: Signals = {"row.value": np.arange(12.0).reshape(3, 4)}
    first = begun(path, _all(path, wide))
    content = portable(first).dump()
    second = begun(path, _all(path, {"row.value": np.ones((1, 4))}))
    portable(second).load(content)
    for name, value in first.outputs().items():
        assert np.array_equal(second.outputs()[name], value)
    for each in (first, second):
        each.step(_all(path, wide), 0, S)
    for name, value in first.outputs().items():
        assert np.array_equal(second.outputs()[name], value)
    first.close()
    second.close()


def _all(path: Path, inputs: Signals) -> Signals:
    connectors = FmuComponentType(path).create("unit", {}).connectors
    starts = {n: c.start_value() for n, c in connectors.items() if c.causality.value == "input"}
    return {**starts, **inputs}


GOES_ON = """
import sys
from pathlib import Path
import numpy as np
from adapters.fmi import FmuComponentType
from orchestrator.capabilities import PortableState
values = {"period": 0.6, "fmi.event_mode": True}
component = FmuComponentType(Path(sys.argv[1])).create("unit", values)
component.setup(0, np.random.default_rng(1))
held = {"level": np.array(1.0), "u": np.array(0.0)}
component.initialise(held)
component.capability(PortableState).load(Path(sys.argv[2]).read_bytes())
component.step(held, 10**9, 10**9)
print(int(component.outputs()["ticks"]), float(component.outputs()["x"]))
"""


def test_another_process_goes_on_from_it(events3: Path, tmp_path: Path) -> None:
    """The next event is part of it: after 1 s, those at 1.2 and 1.8 s are to come."""
    held: Signals = {"level": np.array(1.0), "u": np.array(0.0)}
    component = begun(events3, held, period=0.6, **{"fmi.event_mode": True})
    component.step(held, 0, S)
    (tmp_path / "state").write_bytes(portable(component).dump())
    component.close()
    command = [sys.executable, "-c", GOES_ON, str(events3), str(tmp_path / "state")]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    assert answer.stdout.split() == ["3", "2.0"]


def test_a_host_hands_it_over(bilinear3: Path) -> None:
    """From a process of its own to this one and back."""
    spec = ComponentSpec(name="unit", type=bilinear3, values={})
    with launch([spec], LoopbackTransport()) as remote:
        there, here = remote["unit"], begun(bilinear3, BILINEAR)
        there.setup(0, np.random.default_rng(1))
        there.initialise(BILINEAR)
        there.step({**BILINEAR, "p": np.array(11.0)}, 0, S)
        portable(here).load(portable(there).dump())
        assert np.array_equal(here.outputs()["y"], [22, 33, 6])
        here.step(BILINEAR, S, S)
        portable(there).load(portable(here).dump())
        assert float(there.outputs()["sum"]) == 16
        there.step(BILINEAR, 2 * S, S)
        assert float(there.outputs()["sum"]) == 21
        with pytest.raises(ComponentError, match="these bytes are no state of an FMU"):
            portable(there).load(b"?")
        here.close()


def test_other_bytes_are_refused(bilinear3: Path, product2: Path) -> None:
    component = begun(bilinear3, BILINEAR)
    target = portable(component)
    content = target.dump()
    other = begun(product2, PRODUCT)
    for wrong, said in (
        (b"", "these bytes are no state of an FMU"),
        (content[:30], "these bytes are no state"),
        (content[:-1], f"the state is cut: it has {len(content) - 1} of {len(content)} bytes"),
        (content + b"x", f"the state is cut: it has {len(content) + 1} of {len(content)}"),
        (portable(other).dump(), r"one of the FMU \{product2-test\}, not of \{bilinear3-test\}"),
    ):
        with pytest.raises(FmuError, match=said):
            target.load(wrong)
    more = begun(bilinear3, BILINEAR, **{"fmi.locals": ("time",)})
    with pytest.raises(FmuError, match="the state has other connectors than this component"):
        target.load(portable(more).dump())
    more.close()
    with pytest.raises(FmuError, match="fmi3DeserializeFMUState returned Error"):
        target.load(content.replace(b"bilinear", b"BILINEAR").replace(b"{BILINEAR", b"{bilinear"))
    component.close()
    other.close()


def test_an_fmu_that_cannot_does_not_offer_it(lag2: Path, ends3: Path) -> None:
    for path in (lag2, ends3):
        component = FmuComponentType(path).create("unit", {})
        assert component.capability(PortableState) is None  # type: ignore[type-abstract]
