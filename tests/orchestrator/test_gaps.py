"""Inputs that nothing drives: when that is an error, and what would fill the gap."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from xml.etree import ElementTree as ET

import pytest
from typing_extensions import override

from adapters.fmi.undriven import annotated
from fmus.native.interface import Interface, discrete_input, discrete_output, when_undriven
from fmus.native.model_description import model_description
from orchestrator.absence import Need, Undriven, said_of
from orchestrator.connection import Connection, Endpoint
from orchestrator.gaps import Gap, gaps
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.system import System
from tests.idle import Idle

ALWAYS = Undriven("it stops")
OFFERED = Undriven("it slows down", Need.IF_OFFERED)
NEVER = Undriven("it runs on", Need.NEVER)


class _Part(Idle):
    def __init__(self, **connectors: Connector) -> None:
        self._connectors = {name.replace("__", "."): c for name, c in connectors.items()}

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def outputs(self) -> Signals:
        return {}


def _in(undriven: Undriven | None, unit: str = "m") -> Connector:
    return Connector(causality=Causality.INPUT, unit=unit, undriven=undriven)


def _out(unit: str = "m") -> Connector:
    return Connector(causality=Causality.OUTPUT, unit=unit)


def _gaps(
    parts: Mapping[str, _Part],
    *links: tuple[str, str],
    without: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> list[Gap]:
    connections = tuple(Connection(Endpoint.parse(a), Endpoint.parse(b)) for a, b in links)
    return list(gaps(System(dict(parts), dict.fromkeys(parts, 10), connections), without))


def test_what_is_needed_always_is_missed_without_an_offer() -> None:
    (gap,) = _gaps({"a": _Part(u=_in(ALWAYS))})
    assert (gap.is_needed, gap.fits) == (True, ())
    assert gap.message() == "nothing drives `a.u`: it stops; `without: [u]` if that is meant"


@pytest.mark.parametrize(
    ("outputs", "fits", "needed"),
    [
        ({}, (), False),
        ({"b": _Part(car__x=_out())}, (), False),  # half of it is none
        ({"b": _Part(car__x=_out(), car__y=_out("s"))}, (), False),  # nor is another unit
        ({"b": _Part(car__x=_out(), car__y=_out())}, ("b.car",), True),
        ({"b": _Part(x=_out(), y=_out())}, (), False),  # nor what has no name together
        ({"b": _Part(bus__x=_out(), bus__y=_out())}, ("b.bus",), True),
        ({n: _Part(bus__x=_out(), bus__y=_out()) for n in "bc"}, ("b.bus", "c.bus"), False),
        ({n: _Part(car__x=_out(), car__y=_out()) for n in "bc"}, ("b.car", "c.car"), True),
    ],
)
def test_what_is_needed_if_offered_is_missed_beside_an_offer(
    outputs: Mapping[str, _Part], fits: tuple[str, ...], *, needed: bool
) -> None:
    """One of the same name, or only one that could be meant; all of the group, of its types."""
    (gap,) = _gaps({"a": _Part(car__x=_in(OFFERED), car__y=_in(OFFERED)), **outputs})
    assert (gap.group, gap.inputs) == ("car.*", ("car.x", "car.y"))
    assert (gap.fits, gap.is_needed) == (fits, needed)


def test_an_output_that_the_component_reads_already_is_no_offer() -> None:
    parts = {"a": _Part(u=_in(OFFERED), one__v=_in(NEVER)), "b": _Part(u=_out())}
    (read,) = [g for g in _gaps(parts, ("b.u", "a.one.v")) if g.inputs == ("u",)]
    assert not read.is_needed
    (free,) = [g for g in _gaps(parts) if g.inputs == ("u",)]
    assert free.is_needed


def test_what_may_be_absent_may_not_beside_what_it_goes_with() -> None:
    """If there is an output for it, or several; the one that is read already does not count."""
    beside = Undriven("it is alone", Need.NEVER, frozenset({"v"}))
    parts = {"a": _Part(u=_in(beside), v=_in(NEVER)), "b": _Part(y=_out())}
    assert [g.is_needed for g in _gaps(parts)] == [False, False]
    assert [g.is_needed for g in _gaps(parts, ("b.y", "a.v"))] == [False]
    for count in (1, 2):
        offered = {f"c{n}": _Part(u=_out()) for n in range(count)}
        assert [g.is_needed for g in _gaps(parts | offered)] == [False, False]
        (gap,) = _gaps(parts | offered, ("b.y", "a.v"))
        assert (gap.is_needed, len(gap.fits)) == (True, count)


def test_one_group_is_one_gap_where_all_of_it_says_the_same() -> None:
    part = _Part(car__x=_in(ALWAYS), car__y=_in(ALWAYS), car__z=_in(NEVER), bus__x=_in(ALWAYS))
    assert [g.group for g in _gaps({"a": part})] == ["car.x, car.y", "car.z", "bus.x"]
    message = _gaps({"a": part})[0].message()
    assert message == (
        "`a.car.x, car.y` (2 inputs): nothing drives them: it stops; "
        "`without: [car.x, car.y]` if that is meant"
    )


def test_a_silent_component_is_listed_and_never_wrong() -> None:
    (gap,) = _gaps({"a": _Part(u=_in(None)), "b": _Part(u=_out())})
    assert not gap.is_needed
    assert gap.meaning == "the start value stays"
    assert gap.data()["declared"] is False


def test_the_longest_name_says_what_its_absence_means() -> None:
    said = said_of(["car.x", "car.y", "cart"], {"car": ALWAYS, "car.y": NEVER})
    assert said == {"car.x": ALWAYS, "car.y": NEVER}
    with pytest.raises(ValueError, match="there is no input `cars`"):
        said_of(["car.x"], {"cars": ALWAYS})


def test_a_native_unit_says_it_in_its_description() -> None:
    """As an annotation ahead of dimensions; what an importer cannot understand is ignored."""
    beside = Undriven("it is <alone> & late", Need.IF_OFFERED, frozenset({"w", "v"}))
    inputs = when_undriven(
        [discrete_input(n, "Float64", n, dimensions=(2,)) for n in ("u", "v", "w")],
        {"u": beside, "v": ALWAYS},
    )
    interface = Interface(
        name="unit",
        description="A unit",
        variables=(*inputs, discrete_output("y", "Float64", "y", dependencies=("u",))),
        sources=(),
    )
    root = ET.fromstring(  # noqa: S314  (our own)
        model_description(interface, token="1", version="1")  # noqa: S106  (no secret)
    )
    assert annotated(root) == {"u": beside, "v": ALWAYS}
    variables = root.find("ModelVariables")
    assert variables is not None
    assert [each.tag for each in variables[1]] == ["Annotations", "Dimension"]
    for element in root.iter("Undriven"):
        element.set("need", "sometimes")
    assert annotated(root) == {}


def test_what_the_scenario_does_without_is_no_error_and_the_rest_of_its_group_is() -> None:
    parts = {
        "a": _Part(car__x=_in(ALWAYS), car__y=_in(ALWAYS), cars=_in(ALWAYS)),
        "b": _Part(u=_in(ALWAYS)),
    }
    said = {"a": ["car"]}
    found = [(g.component, g.inputs, g.is_needed, g.is_meant) for g in _gaps(parts, without=said)]
    assert found == [
        ("a", ("car.x", "car.y"), False, True),
        ("a", ("cars",), True, False),  # it begins as the group does, and is none of it
        ("b", ("u",), True, False),
    ]
    one, other, *_ = _gaps(parts, without={"a": ["car.y"]})
    assert (one.inputs, one.is_needed, other.inputs, other.is_meant) == (
        ("car.x",), True, ("car.y",), True
    )  # fmt: skip


def test_an_error_says_how_its_absence_is_meant() -> None:
    (gap,) = _gaps({"a": _Part(car__x=_in(ALWAYS), car__y=_in(ALWAYS))})
    assert gap.message().endswith("it stops; `without: [car]` if that is meant")
    (meant,) = _gaps({"a": _Part(u=_in(ALWAYS))}, without={"a": ["u"]})
    assert meant.message() == "nothing drives `a.u`: it stops"
    assert meant.data()["meant"] is True
