"""Small scenes in SUMO, and what the component signals of them."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from adapters.sumo import SumoTraffic
from adapters.sumo.entities import Entity, Position
from adapters.sumo.parameters import TrafficParameters
from orchestrator.randomness import stream
from orchestrator.signal import Signals

NETS = Path(__file__).parent / "nets"
RED_LIGHT = Path(__file__).parents[2] / "scenarios" / "assets" / "red_light" / "red_light.sumocfg"

H = 100_000_000
"""Step size, and SUMO's step, of the scenes here [ns]."""

COAST = (0.0, 0.0, 0.0)
BRAKE = (0.0, 1.0, 0.0)

TYPES = """
    <vType id="car" length="5" width="1.8" height="1.5" speedDev="0" sigma="0"/>
    <vType id="van" vClass="delivery" length="6" width="2" speedDev="0" sigma="0"/>
    <vType id="bike" vClass="bicycle"/>
"""

Float = npt.NDArray[np.float64]
Command = tuple[float, float, float]
Policy = Callable[[float], Mapping[str, Command]]


def scene(
    folder: Path, net: str = "street", demand: str = "", options: str = "", extra: str = ""
) -> Path:
    """A configuration of the types above.

    Args:
        folder: to write it to.
        net: of `NETS`.
        demand: elements of the route file, ordered by departure.
        options: elements of the configuration.
        extra: elements of the additional file, in which the types are.
    """
    (folder / "types.xml").write_text(f"<additional>{TYPES}{extra}</additional>")
    (folder / "demand.xml").write_text(f"<routes>{demand}</routes>")
    path = folder / "scene.sumocfg"
    path.write_text(
        f"""<configuration>
    <net-file value="{NETS / net}.net.xml"/>
    <additional-files value="types.xml"/>
    <route-files value="demand.xml"/>
    {options}
</configuration>"""
    )
    return path


def on(lane: str, s: float | None = None, **more: Any) -> Position:
    """A place on a lane."""
    return Position(lane=lane, s=s, **more)


def car(lane: str, s: float | None = None, **more: Any) -> Entity:
    """A car on a lane; it stands if no speed is given."""
    return Entity(type="car", position=on(lane, s), **more)


@dataclass(frozen=True)
class Run:
    """The outputs at each communication point, and who is who.

    Attributes:
        points: signals at 0, h, 2 h, ...
        number: by name, the last number that somebody of that name had.
        name: by number.
    """

    points: list[Signals]
    number: Mapping[str, int]
    name: Mapping[int, str]

    def array(self, k: int, name: str) -> Any:
        """A signal at a communication point."""
        return np.asarray(self.points[k][name])

    def row(self, k: int, name: str) -> int | None:
        """Where somebody is in the arrays."""
        rows = np.flatnonzero(self.array(k, "vehicle.id") == self.number.get(name, -2))
        return int(rows[0]) if len(rows) else None

    def of(self, name: str, signal: str) -> Float:
        """A signal of somebody at all communication points; not a number where it is not there."""
        shape = self.array(0, f"vehicle.{signal}").shape[1:]
        values = np.full((len(self.points), *shape), np.nan)
        for k in range(len(self.points)):
            row = self.row(k, name)
            if row is not None:
                values[k] = self.array(k, f"vehicle.{signal}")[row]
        return values

    def present(self, k: int) -> list[str]:
        """Names of those who are there, by number."""
        return [self.name[int(number)] for number in self.array(k, "vehicle.id")]

    def series(self, signal: str) -> Any:
        """A signal without a changing shape, at all communication points."""
        return np.array([self.array(k, signal) for k in range(len(self.points))])


def steps(
    parameters: TrafficParameters, seconds: float, policy: Policy, seed: int, h: int
) -> Iterator[Signals]:
    """The outputs at each communication point."""
    with closing(SumoTraffic(parameters)) as traffic:
        traffic.setup(0, stream(seed, "traffic"))
        yield traffic.outputs()
        for k in range(round(seconds * 1e9) // h):
            commands = policy(k * h / 1e9)
            inputs = {
                name: np.array(commands.get(name.removesuffix(".command"), COAST))
                for name in traffic.connectors
                if name.endswith(".command")
            }
            traffic.step(inputs, k * h, h)
            yield traffic.outputs()


def nobody_drives(_: float) -> Mapping[str, Command]:
    return {}


def simulate(
    scene: Path,
    seconds: float,
    entities: Mapping[str, Entity | None] | None = None,
    *,
    policy: Policy = nobody_drives,
    seed: int = 1,
    h: int = H,
    **more: Any,
) -> Run:
    """A run of the component alone; egos coast unless `policy` says otherwise."""
    more.setdefault("step_length", h / 1e9)
    parameters = TrafficParameters(scene=scene, entities=entities or {}, **more)
    points = list(steps(parameters, seconds, policy, seed, h))
    entered = [
        (int(number), str(name))
        for signals in points
        for number, name, _ in json.loads(bytes(signals["entered"]) or b"[]")
    ]
    return Run(points, {name: number for number, name in entered}, dict(entered))
