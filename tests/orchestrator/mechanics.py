"""Coupled mechanical systems for the tests of coupling algorithms."""

from tests.orchestrator.linear_parts import Network, Part


def moved(mass: float, stiffness: float, damping: float, start: tuple[float, float]) -> Part:
    """A mass on its own spring, moved by a force `f`; tells `x` and `v`."""
    return Part(
        a=[[0, 1], [-stiffness / mass, -damping / mass]],
        b=[[0], [1 / mass]],
        c=[[1, 0], [0, 1]],
        d=[[0], [0]],
        start=start,
        inputs=("f",),
        outputs=("x", "v"),
    )


def moving(
    mass: float,
    stiffness: float,
    damping: float,
    spring: tuple[float, float],
    start: tuple[float, float],
) -> Part:
    """A mass on its own spring, and a spring (stiffness, damping) to what is at `x`, `v`.

    It tells the force `f` of that spring on the other end, and its own `y`, `w`.
    """
    k, c = spring
    return Part(
        a=[[0, 1], [-(stiffness + k) / mass, -(damping + c) / mass]],
        b=[[0, 0], [k / mass, c / mass]],
        c=[[k, c], [1, 0], [0, 1]],
        d=[[-k, -c], [0, 0], [0, 0]],
        start=start,
        inputs=("x", "v"),
        outputs=("f", "y", "w"),
    )


def two_masses(spring: tuple[float, float] = (2.0, 0.1)) -> Network:
    """Two oscillators, force-displacement coupling; no algebraic loop."""
    return Network(
        {
            "left": moved(1.0, 1.0, 0.0, (1.0, 0.0)),
            "right": moving(1.0, 5.0, 0.0, spring, (-1.0, 0.0)),
        },
        ("left.x > right.x", "left.v > right.v", "right.f > left.f"),
    )


def three_masses() -> Network:
    """left - middle - right: the middle one is moved by both springs."""
    middle = Part(
        a=[[0, 1], [-1.0, -0.1]],
        b=[[0, 0], [1, 1]],
        c=[[1, 0], [0, 1]],
        d=[[0, 0], [0, 0]],
        start=(0.0, 0.0),
        inputs=("f", "g"),
        outputs=("x", "v"),
    )
    return Network(
        {
            "middle": middle,
            "left": moving(1.0, 1.0, 0.1, (5.0, 0.2), (1.0, 0.0)),
            "right": moving(2.0, 1.0, 0.1, (3.0, 0.1), (0.0, 0.0)),
        },
        (
            "middle.x > left.x",
            "middle.v > left.v",
            "middle.x > right.x",
            "middle.v > right.v",
            "left.f > middle.f",
            "right.f > middle.g",
        ),
    )


def quarter_car() -> Network:
    """A wheel of 40 kg on its tyre, which is displaced, and a chassis of 400 kg above it [SI]."""
    return Network(
        {
            "wheel": moved(40.0, 150_000.0, 0.0, (0.02, 0.0)),
            "chassis": moving(400.0, 0.0, 0.0, (15_000.0, 1_000.0), (0.0, 0.0)),
        },
        ("wheel.x > chassis.x", "wheel.v > chassis.v", "chassis.f > wheel.f"),
    )


def clutches() -> Network:
    """Two shafts and the viscous friction of a clutch between them, which has no state."""

    def shaft(friction: float, speed: float) -> Part:
        return Part(
            a=[[-friction]],
            b=[[1.0]],
            c=[[1.0]],
            d=[[0.0]],
            start=(speed,),
            inputs=("torque",),
            outputs=("w",),
        )

    friction = Part(
        a=[],
        b=[],
        c=[],
        d=[[-2.0, 2.0], [2.0, -2.0]],
        start=(),
        inputs=("a", "b"),
        outputs=("on_a", "on_b"),
    )
    return Network(
        {
            "engine": shaft(0.1, 10.0),
            "load": shaft(0.5, 0.0),
            "clutch": friction,
        },
        (
            "engine.w > clutch.a",
            "load.w > clutch.b",
            "clutch.on_a > engine.torque",
            "clutch.on_b > load.torque",
        ),
    )


def rigid(ratio: float) -> Network:
    """Two masses whose accelerations depend on each other: an algebraic loop of gain -`ratio`.

    The right one, without a spring of its own, is led by the acceleration of the left one and gives
    back its inertia as a force.
    """
    left = Part(
        a=[[0, 1], [-4.0, -0.2]],
        b=[[0], [1.0]],
        c=[[1, 0], [-4.0, -0.2]],
        d=[[0], [1.0]],
        start=(1.0, 0.0),
        inputs=("f",),
        outputs=("x", "acceleration"),
    )
    right = Part(
        a=[],
        b=[],
        c=[],
        d=[[-ratio]],
        start=(),
        inputs=("acceleration",),
        outputs=("f",),
    )
    return Network(
        {"left": left, "right": right},
        ("left.acceleration > right.acceleration", "right.f > left.f"),
    )
