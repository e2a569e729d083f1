"""The ego vehicle of tests that drive it by hand."""

from adapters.sumo.ego import EgoDynamics

DYNAMICS = EgoDynamics(
    wheelbase=2.85,
    max_acceleration=3.0,
    max_braking=8.0,
    actuator_lag=0.1,
    max_steering=0.6,
    max_steering_rate=0.8,
)
