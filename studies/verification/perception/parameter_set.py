"""Sets of parameters of the perception unit that are compared."""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from fmus.localisation import Accuracy

MATRIX: Final = frozenset(
    {"rows", "columns", "cell", "offset", "floor", "ceiling", "layer", "message",
     "index", "index_levels"}
)  # fmt: skip
"""The parameters that change the messages, not only what is made of them."""
DEFAULTS: Final = {"corridor": 25.0}
"""Defaults of parameters that vary, but that no set of `LADDER` has. A curve shows the recommended
set there."""
PERFECT: Final = Accuracy(position=0.0, heading=0.0, correlation=0)
"""Vehicles know exactly where they are."""
_SIDE: Final = 100.0
"""Side of the matrix [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterSet:
    """Parameters of the perception unit, and how well vehicles know where they are.

    Attributes:
        name: in tables.
        values: those that differ from the defaults, by name.
        uses_road: whether the ego vehicle knows the drivable surface.
        accuracy: of the localisation of all vehicles.
    """

    name: str
    values: Mapping[str, Any] = field(default_factory=dict)
    uses_road: bool = True
    accuracy: Accuracy = PERFECT

    @property
    def matrix(self) -> Mapping[str, Any]:
        """The values that change the messages."""
        return {key: self.values[key] for key in sorted(self.values.keys() & MATRIX)}

    @property
    def messages(self) -> Hashable:
        """What the messages depend on: sets for which it is equal can share them."""
        return tuple(self.matrix.items()), self.accuracy

    def but(self, name: str, **values: Any) -> "ParameterSet":
        """A copy of this set under another name, with other values of some parameters."""
        return replace(self, name=name, values={**self.values, **values})

    def mislocated(
        self, name: str, *, position: float = 0.0, heading: float = 0.0
    ) -> "ParameterSet":
        """A copy under another name, of vehicles that are wrong about their poses.

        Args:
            name: in tables.
            position: standard deviation of each coordinate [m].
            heading: standard deviation [rad].
        """
        accuracy = Accuracy(position=position, heading=heading, correlation=0)
        return replace(self, name=name, accuracy=accuracy)


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Sets in which one parameter varies.

    Attributes:
        label: what they have in common.
        panel: title of the diagram it is drawn into.
        parameter: what varies.
        sets: by the value of it.
    """

    label: str
    panel: str
    parameter: str
    sets: Mapping[float, ParameterSet]


def matrix_of(cell: float) -> dict[str, Any]:
    """Parameters of a matrix over 100 m x 100 m with cells of this side [m]; no layer."""
    count = round(_SIDE / cell)
    return {"cell": cell, "rows": count, "columns": count, "layer": False}


PAPER: Final = ParameterSet(
    name="as in the paper",
    values={"layer": False, "index": "points", "region_benefit": False},
    uses_road=False,
)
"""A fixed T1, an index that counts points without a limit, no map."""
ROAD: Final = ParameterSet(
    name="... on the road", values={"layer": False, "index": "points", "benefit_threshold": 300.0}
)
LIMIT: Final = ROAD.but("... index_limit 10", index_limit=10, benefit_threshold=100.0)
FINE: Final = LIMIT.but("... cells of 2.5 m", **matrix_of(2.5), n_blind_zone=1024, threshold=5.0)
SEEN: Final = ParameterSet(
    name="seen area, 5 m",
    values={
        "layer": False,
        "message": "compressed",
        "index": "seen_area",
        "index_levels": 3,
        "seen_threshold": 0.35,
        "seen_benefit_threshold": 10.0,
    },
)
"""The index is the share of the cell's ground that is seen."""
SEEN_FINE: Final = SEEN.but("seen area, 2.5 m", **matrix_of(2.5), n_blind_zone=1024)
RECOMMENDED: Final = SEEN_FINE.but("recommended", **matrix_of(1.25), window_largest=2)
LADDER: Final[Sequence[ParameterSet]] = (PAPER, ROAD, LIMIT, FINE, SEEN, SEEN_FINE, RECOMMENDED)
"""From the paper's method to the recommended one."""

_WINDOWS: Final = ((1, 1), (1, 4), (2, 4))
"""Smallest and largest side of windows, in cells."""


def _zone_curves() -> tuple[Curve, ...]:
    """Curves over T1, for several cells and windows."""
    panels = (
        (LIMIT, "number of points", 5.0, {"threshold": (2.0, 10.0, 40.0)}),
        (SEEN, "seen share", 5.0, {"seen_threshold": (0.2, 0.35, 0.6)}),
        (SEEN, "seen share", 1.25, {"seen_threshold": (0.2, 0.35, 0.6)}),
    )
    return tuple(
        _zone_curve(base, index, cell, windows, varied)
        for base, index, cell, varied in panels
        for windows in _WINDOWS
    )


def _zone_curve(
    base: ParameterSet,
    index: str,
    cell: float,
    windows: tuple[int, int],
    varied: Mapping[str, Sequence[float]],
) -> Curve:
    """A curve over one parameter; `varied` has it, and its values."""
    ((parameter, values),) = varied.items()
    smallest, largest = windows
    panel = f"{cell:g} m, {index}"
    label = f"{cell * smallest:g} to {cell * largest:g} m"
    fixed = {
        **matrix_of(cell), "window_smallest": smallest, "window_largest": largest,
        "n_blind_zone": 2048,
    }  # fmt: skip
    sets = {
        value: base.but(f"{panel}, windows {label}, T1 = {value:g}", **fixed, **{parameter: value})
        for value in values
    }
    return Curve(label=label, panel=panel, parameter=parameter, sets=sets)


def _sharer_curve(panel: str, parameter: str, values: Sequence[float]) -> Curve:
    sets = {value: _varied(f"{parameter} = {value:g}", {parameter: value}) for value in values}
    return Curve(label="", panel=panel, parameter=parameter, sets=sets)


def _cell_curve() -> Curve:
    sets = {cell: _varied(f"cell = {cell:g}", matrix_of(cell)) for cell in (5.0, 2.5, 2.0, 1.25)}
    return Curve(label="", panel="side of the cells [m]", parameter="cell", sets=sets)


def _position_curve(metres: Sequence[float]) -> Curve:
    sets = {
        value: RECOMMENDED.mislocated(f"recommended, position_error = {value:g}", position=value)
        if value
        else RECOMMENDED
        for value in metres
    }
    panel = "error of the position [m]"
    return Curve(label="", panel=panel, parameter="position_error", sets=sets)


def _heading_curve(degrees: Sequence[float]) -> Curve:
    sets = {
        value: RECOMMENDED.mislocated(
            f"recommended, heading_error = {value:g} deg", heading=math.radians(value)
        )
        if value
        else RECOMMENDED
        for value in degrees
    }
    return Curve(label="", panel="error of the heading [deg]", parameter="heading_error", sets=sets)


def _varied(name: str, values: Mapping[str, Any]) -> ParameterSet:
    one = RECOMMENDED.but(f"recommended, {name}", **values)
    usual = {**DEFAULTS, **RECOMMENDED.values}
    return RECOMMENDED if {**DEFAULTS, **one.values} == usual else one


ZONE_CURVES: Final = _zone_curves()
SHARER_CURVES: Final = (
    _cell_curve(),
    _sharer_curve("levels of the index", "index_levels", (1, 3, 15)),
    _sharer_curve("T1, a seen share", "seen_threshold", (0.2, 0.35, 0.5)),
    _sharer_curve("benefit threshold [m$^2$]", "seen_benefit_threshold", (5.0, 10.0, 20.0)),
    _sharer_curve("corridor [m]", "corridor", (15.0, 20.0, 25.0, 30.0)),
    _position_curve((0.0, 0.5, 1.0, 2.0)),
    _heading_curve((0.0, 0.5, 1.0, 2.0)),
)
"""One parameter of the recommended set varies."""


def all_sets() -> tuple[ParameterSet, ...]:
    """Every set that is compared, each once."""
    curves = (*ZONE_CURVES, *SHARER_CURVES)
    sets = [*LADDER, *(one for curve in curves for one in curve.sets.values())]
    return tuple({one.name: one for one in sets}.values())
