"""Who drives and walks in a city: most of them from the first step on, each on a way of its own."""

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Final

from scenarios.assets.city.streets import Streets

AT_START: Final = 1000
"""Vehicles that depart at 0 s, bicycles not counted, of the whole demand (`scale` 1)."""

_BICYCLES: Final = 60
_PERSONS: Final = 200
_LATER: Final = 1.2
"""Vehicles that depart per second after that, about as many as arrive."""

_UNTIL: Final = 120
"""The last of them [s]."""

_WAY: Final = (0.0, 4000.0)
"""How far vehicles drive [m]."""

_WALK: Final = (200.0, 800.0)
"""How far persons walk [m]."""

_CARS: Final = ("supermini", "hatchback", "hatchback", "sedan", "compact", "suv", "mpv")
_SHARES: Final = (
    (0.72, _CARS), (0.10, ("van",)), (0.04, ("bus",)), (0.09, ("box_truck",)),
    (0.05, ("motorcycle",)),
)  # fmt: skip
"""Of the vehicles with an engine; the types are those of `city.typ.xml`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Walker:
    """Draws ways through the net; edges are drawn by their length."""

    streets: Streets
    rng: Random

    def way(self, bounds: tuple[float, float]) -> str:
        """Edges, for so many metres; at crossings it goes on at random."""
        lengths = self.streets.lengths
        names = sorted(lengths)
        (edge,) = self.rng.choices(names, weights=[lengths[name] for name in names])
        edges, rest = [edge], self.rng.uniform(*bounds)
        while rest > 0.0 and self.streets.following[edge]:
            edge = self.rng.choice(self.streets.following[edge])
            edges.append(edge)
            rest -= lengths[edge]
        return " ".join(edges)


def demand(streets: Streets, rng: Random) -> str:
    """The text of a SUMO route file.

    Types are shuffled, because the option `scale` takes every so many-th of those who depart.

    Args:
        streets: of the net.
        rng: draws types, ways and times.
    """
    walker = _Walker(streets=streets, rng=rng)
    vehicles = [_kind(rng) for _ in range(AT_START)] + ["bicycle"] * _BICYCLES
    rng.shuffle(vehicles)
    times = sorted(rng.uniform(1.0, _UNTIL) for _ in range(round(_LATER * _UNTIL)))
    lines = ["<routes>"]
    lines += [_vehicle(f"v{k}", kind, 0.0, walker) for k, kind in enumerate(vehicles)]
    lines += _persons(walker)
    lines += [_vehicle(f"w{k}", _kind(rng), at, walker) for k, at in enumerate(times)]
    return "\n".join([*lines, "</routes>", ""])


def _kind(rng: Random) -> str:
    (found,) = rng.choices([kinds for _, kinds in _SHARES], [share for share, _ in _SHARES])
    return rng.choice(found)


def _vehicle(name: str, kind: str, at: float, walker: _Walker) -> str:
    where = 'departPos="random_free" departSpeed="max"' if at == 0.0 else 'departSpeed="max"'
    return (
        f'<vehicle id="{name}" type="{kind}" depart="{at:.1f}" departLane="best" {where}>'
        f'<route edges="{walker.way(_WAY)}"/></vehicle>'
    )


def _persons(walker: _Walker) -> Iterator[str]:
    for number in range(_PERSONS):
        edges = walker.way(_WALK)
        yield (
            f'<person id="p{number}" type="walker" depart="0.0" departPos="random">'
            f'<walk edges="{edges}"/></person>'
        )
