"""Probes: the models of the channel between any two points, without a packet."""

import re
from collections.abc import Sequence

import numpy as np
import pytest

from fmus.messages.bodies import Body
from orchestrator.signal import Array
from tests.fmus.driver import Library, Refused
from tests.fmus.scene import SIZES, Building, Scene, Vehicle, rectangle

from .harness import LIGHT_SPEED, Channel, one_frame, packet

OUTPUTS = (
    "path_loss", "antenna_gain", "building_loss", "vehicle_loss", "power", "link",
    "header_success", "payload_success",
)  # fmt: skip
NAN = float("nan")
HOUSE = Building(ring=rectangle(50.0, 0.0, 10.0, 10.0), height=10.0)
TRUCK = Vehicle(id=5, position=(20.0, 40.0, 0.0), size=(8.0, 2.5, 4.0), antenna_height=4.1)


def probe(
    library: Library,
    scene: Scene,
    transmitter: Sequence[Sequence[float]],
    receiver: Sequence[Sequence[float]],
    *,
    carrier: Sequence[Sequence[int]] | None = None,
    size: int = 200,
    **parameters: float,
) -> dict[str, Array]:
    """All outputs `probe.*` for these links, after one step."""
    n = len(transmitter)
    with Channel(library, scene, **parameters) as channel:
        channel.resize(n_probe=n)
        channel.set("probe.transmitter", np.array(transmitter, float).reshape(n, 3))
        channel.set("probe.receiver", np.array(receiver, float).reshape(n, 3))
        channel.set("probe.carrier", np.array(carrier or [(-1, -1)] * n, np.int64))
        channel.set("probe.size", np.full(n, size, np.uint32))
        channel.step(0.0, 0.1, [])
        return {name: channel.get(f"probe.{name}", n) for name in OUTPUTS}


def test_what_is_in_the_way_is_told_model_by_model(library: Library) -> None:
    scene = Scene(vehicles=[TRUCK], buildings=[HOUSE])
    lanes = (0, 40, 80)
    out = probe(library, scene, [(0, y, 1.5) for y in lanes], [(100, y, 1.5) for y in lanes])
    friis = 20 * np.log10(4 * np.pi * 100 * 5.9e9 / LIGHT_SPEED)
    np.testing.assert_allclose(out["path_loss"], friis, atol=1e-9)
    np.testing.assert_array_equal(out["antenna_gain"], 0)
    np.testing.assert_allclose(out["building_loss"], [2 * 9 + 10 * 0.4, 0, 0])
    v = 2.5 * np.sqrt(2 * 5.9e9 / LIGHT_SPEED * (1 / 20 + 1 / 80))
    knife = 6.9 + 20 * np.log10(np.hypot(v - 0.1, 1) + v - 0.1)
    np.testing.assert_allclose(out["vehicle_loss"], [0, knife, 0], atol=1e-9)
    np.testing.assert_array_equal(out["link"], [2, 1, 0])
    loss = out["path_loss"] + out["building_loss"] + out["vehicle_loss"]
    np.testing.assert_allclose(out["power"], 26 - loss, atol=1e-9)


def test_narrow_bodies_do_not_shadow(library: Library) -> None:
    """Less than `shadow_width` wide, whatever way they stand; Veins takes each for a knife edge."""
    lanes = {Body.PEDESTRIAN: 0.0, Body.BICYCLE: 20.0, Body.MOTORCYCLE: 40.0, Body.CAR: 60.0}
    scene = Scene(
        vehicles=[
            Vehicle(id=k, position=(25.0, y, 0.0), heading=np.pi / 2, size=SIZES[body], body=body)
            for k, (body, y) in enumerate(lanes.items())
        ]
    )

    def loss(**parameters: float) -> Array:
        near, far = ([(x, y, 1.3) for y in lanes.values()] for x in (0, 50))
        return probe(library, scene, near, far, carrier=None, size=200, **parameters)[
            "vehicle_loss"
        ]

    h = np.array([SIZES[body][2] for body in lanes]) - 1.3
    v = h * np.sqrt(2 * 5.9e9 / LIGHT_SPEED * (1 / 25 + 1 / 25))
    knife = 6.9 + 20 * np.log10(np.hypot(v - 0.1, 1) + v - 0.1)
    np.testing.assert_allclose(loss(), [0, 0, 0, knife[3]], atol=1e-9)
    np.testing.assert_allclose(loss(shadow_width=0.0), knife, atol=1e-9)
    np.testing.assert_allclose(loss(shadow_width=0.65), [0, *knife[1:]], atol=1e-9)
    np.testing.assert_array_equal(loss(shadow_width=2.0), 0.0)
    np.testing.assert_allclose(
        loss(model=2), loss(model=2, shadow_width=2.0), atol=0, err_msg="Veins: 0"
    )
    assert (loss(model=2) > 8.0).all()


@pytest.mark.parametrize("model", [1, 2])  # nlosim, veins
def test_a_probe_along_a_link_says_what_a_frame_meets(library: Library, model: int) -> None:
    other = Vehicle(id=9, position=(90.0, 60.0, 0.0), heading=2.0)
    scene = Scene(vehicles=[Vehicle(id=1), TRUCK, other], buildings=[HOUSE])
    antenna = []
    for v in scene.vehicles:
        ahead = v.size[0] / 2 if model == 2 else 0.0
        x, y = ahead * np.cos(v.heading), ahead * np.sin(v.heading)
        height = 1.895 if model == 2 else v.antenna_height
        antenna.append((v.position[0] + x, v.position[1] + y, v.position[2] + height))
    carriers = [(1, 5), (1, 9)]
    out = probe(library, scene, antenna[:1] * 2, antenna[1:], carrier=carriers, model=model)
    frames = one_frame(library, scene, packet(1, 1), model=model)
    np.testing.assert_allclose(out["power"], [frames[v]["power_dbm"] for v in (5, 9)], atol=1e-9)
    np.testing.assert_array_equal(out["link"], [frames[v]["link"] for v in (5, 9)])


def test_success_falls_with_size_and_distance(library: Library) -> None:
    scene = Scene(vehicles=[Vehicle(id=0, position=(0.0, 90.0, 0.0))])
    receivers = [(d, 0, 1.5) for d in (10.0, 2600.0, 2900.0, 3200.0)]
    short, long = (
        probe(library, scene, [(0, 0, 1.5)] * 4, receivers, size=size) for size in (10, 4000)
    )
    for out in (short, long):
        assert out["payload_success"][0] == out["header_success"][0] == 1
        assert (np.diff(out["payload_success"]) <= 0).all()
    assert (long["payload_success"][1:] < short["payload_success"][1:]).all()
    np.testing.assert_array_equal(long["header_success"], short["header_success"])


def test_no_probe_and_probes_of_one_point_are_fine(library: Library) -> None:
    scene = Scene(vehicles=[Vehicle(id=0)])
    assert len(probe(library, scene, [], [])["power"]) == 0
    for path_loss in (1, 2, 3):  # exponent, two_ray, breakpoint
        out = probe(library, scene, [(3, 4, 0)], [(3, 4, 0)], path_loss=path_loss)
        assert all(np.isfinite(values).all() for values in out.values())
        assert out["path_loss"][0] == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"transmitter": [(0, NAN, 0)]}, "probe.transmitter[0, 1] is nan"),
        ({"receiver": [(0, 0, float("inf"))]}, "probe.receiver[0, 2] is inf"),
        ({"carrier": [(0, 8)]}, "probe.carrier[0, 1] is 8; there is no such vehicle"),
        (
            {"size": 5000},
            "probe.size[0] is 5000 bytes; with 38 of headers a frame has at most 4095",
        ),
    ],
)
def test_wrong_probes_are_refused(
    library: Library, change: dict[str, object], message: str
) -> None:
    link: dict[str, object] = {"transmitter": [(0, 0, 1)], "receiver": [(9, 0, 1)]}
    with pytest.raises(Refused, match=re.escape(message)):
        probe(library, Scene(vehicles=[Vehicle(id=0)]), **(link | change))  # type: ignore[arg-type]
