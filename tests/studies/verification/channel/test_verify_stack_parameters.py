"""The models of a run in words become parameters of the channel, or are refused."""

from typing import Any

import pytest

from studies.verification.channel.golden_files import GoldenError, Node, read_json
from studies.verification.channel.stack_parameters import run_parameters

from .golden_sample import GOLDEN, RUN


def run_json(**changes: Any) -> Node:
    known = read_json(GOLDEN / RUN / "run.json", "run.json")
    return Node("run.json", "", {**known.value, **changes})


@pytest.mark.parametrize(
    ("models", "parameters"),
    [
        (["SimplePathlossModel alpha=2"], {"path_loss": "exponent", "path_loss_exponent": 2.0}),
        (["simplepathlossmodel"], {"path_loss": "exponent", "path_loss_exponent": 2.0}),
        (["SimplePathlossModel  alpha = 2.75"], {"path_loss_exponent": 2.75}),
        (
            ["TwoRayInterferenceModel eps_r=1.02 (antenna heights 1.895 m)"],
            {"path_loss": "two_ray", "permittivity": 1.02},
        ),
        (["TwoRayInterferenceModel DielectricConstant=5"], {"permittivity": 5.0}),
        (
            ["BreakpointPathlossModel L01=47.9 L02=86 alpha1=2 alpha2=3.8 breakpointDistance=80"],
            {
                "path_loss": "breakpoint",
                "breakpoint_near_loss": 47.9,
                "breakpoint_far_loss": 86.0,
                "path_loss_exponent": 2.0,
                "breakpoint_far_exponent": 3.8,
                "breakpoint_distance": 80.0,
            },
        ),
        (
            ["SimpleObstacleShadowing 12.5 dB/cut, 0 dB/m", "SimplePathlossModel alpha=2"],
            {"building_shadowing": True, "wall_loss": 12.5, "indoor_loss": 0.0},
        ),
        (
            ["SimplePathlossModel alpha=2", "VehicleObstacleShadowing"],
            {"building_shadowing": False, "vehicle_shadowing": True},
        ),
    ],
)
def test_models_are_understood(models: list[str], parameters: dict[str, Any]) -> None:
    found = run_parameters(run_json(models=models)).channel
    assert {name: found[name] for name in parameters} == parameters
    assert found["model"] == "veins"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"models": []}, "models: there is no path-loss model in the list"),
        ({"models": ["VehicleObstacleShadowing"]}, "there is no path-loss model"),
        (
            {"models": ["SimplePathlossModel", "TwoRayInterferenceModel eps_r=1.02"]},
            r"models\[1\]: there is another path-loss model",
        ),
        ({"models": ["TwoRayInterferenceModel"]}, "cannot be interpreted: `eps_r=NUMBER`"),
        ({"models": ["SimpleObstacleShadowing"]}, "write `SimpleObstacleShadowing 9 dB/cut"),
        ({"models": ["BreakpointPathlossModel L01=4"]}, "`l02=NUMBER` is missing"),
        ({"models": ["NakagamiFading m=1"]}, "`NakagamiFading` is not known"),
        ({"bitrate_bps": 5e6}, "bitrate_bps: 5e\\+06 is no rate of a 10 MHz channel"),
        ({"mpdu_bits": 1601}, "mpdu_bits: 1601 bits are no whole number of bytes"),
        ({"access_category": "VO"}, "access_category: `VO` is not known"),
        ({"set_host_speed": True}, "set_host_speed: this run cannot be interpreted"),
        ({"propagation_delay": False}, "propagation_delay: this run cannot be interpreted"),
        ({"antenna": "monopole, z=1.895 m"}, "antenna: this run cannot be interpreted"),
        ({"antenna": "isotropic 0 dBi, z=1.5 m"}, "antenna: this run cannot be interpreted"),
        ({"antenna": "isotropic (hostPositionOffset 1.2)"}, "antenna: this run cannot be"),
    ],
)
def test_what_the_channel_cannot_be_set_to_is_refused(
    changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(GoldenError, match=message):
        run_parameters(run_json(**changes))
