"""What the chosen sharer sends of the ego vehicle's blind zones."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fmus.facilities.answers import ANSWER_HEADER, DemandedAnswers
from fmus.facilities.inputs import BlindZones
from fmus.facilities.sensor_data import SensorData
from fmus.messages.records import OBJECT, POINT, SENSOR, frame
from fmus.perception.interface import INTERFACE
from studies.verification.perception.bytes_on_air import (
    FEATURES,
    RAW_POINT,
    Demanded,
    Matrices,
    demand,
)
from studies.verification.perception.generator import draw_scene
from studies.verification.perception.parameter_set import (
    DEFAULTS,
    LADDER,
    RECOMMENDED,
    SHARER_CURVES,
)
from studies.verification.perception.scene import Scene
from studies.verification.perception.scoring import zone_area
from studies.verification.perception.session import Match, Scans, UnitsUnderTest
from studies.verification.perception.truth import Interest, Truth, find_truth

from .conftest import SEED

pytestmark = pytest.mark.slow


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """A scene with all that the units say about it."""

    scene: Scene
    truth: Truth
    scans: Scans
    matrices: Matrices
    match: Match

    def demand(self, match: Match) -> Demanded:
        area = zone_area(match, self.matrices.heading(self.scene.ego))
        return demand(self.scene, self.truth, self.scans, self.matrices, match, area=area)


@pytest.fixture(scope="module", params=range(3))
def setting(units: UnitsUnderTest, request: pytest.FixtureRequest) -> Setting:
    scene = draw_scene(SEED, request.param)
    scans = units.scan(scene, request.param)
    messages, _ = units.apms(scene, scans, RECOMMENDED.matrix)
    match = units.match(scene, scans, messages, RECOMMENDED)
    assert match.trigger
    return Setting(
        scene=scene,
        truth=find_truth(scene, Interest()),
        scans=scans,
        matrices=Matrices(messages),
        match=match,
    )


def with_zones(match: Match, *zones: tuple[float, float, float]) -> Match:
    """By x, y and half the side."""
    values = np.array(zones, float).reshape(-1, 3)
    return replace(match, centers=values[:, :2], ranges=values[:, 2])


def test_no_more_than_the_whole_scan(setting: Setting) -> None:
    found, (sharer, *_) = setting.demand(setting.match), setting.match.sharers
    assert 0.0 < found.area <= setting.truth.areas[sharer] + 1e-9
    assert 0 < found.points < found.all_points == setting.scans.counts[sharer]
    assert found.vehicles <= len(setting.truth.found_by(sharer))
    assert 0 < found.share < 1
    assert found.request == 100 + 12 * len(setting.match.ranges)


def test_the_size_is_that_of_the_answer_of_facilities(setting: Setting) -> None:
    found = setting.demand(setting.match)
    answers, heading = DemandedAnswers(FEATURES), setting.matrices.heading(setting.scene.ego)
    blind_zones = BlindZones(centers=setting.match.centers, ranges=setting.match.ranges)
    message = setting.matrices.message(setting.match.sharers[0])
    nothing = SensorData(objects=np.empty(0, OBJECT))
    sent = answers.answer(answers.asked(blind_zones, heading), message, nothing)
    assert found.answer(FEATURES) == sent.size
    assert found.answer(0) == ANSWER_HEADER + RAW_POINT * found.points


def test_zones_around_everything_get_the_whole_scan(setting: Setting) -> None:
    x, y = setting.scene.by_id[setting.scene.ego].position
    found = setting.demand(with_zones(setting.match, (x, y, 1000.0)))
    (sharer, *_) = setting.match.sharers
    assert found.answer(FEATURES) == ANSWER_HEADER + FEATURES
    assert found.answer_by_points(FEATURES) == ANSWER_HEADER + FEATURES
    assert found.points == setting.scans.counts[sharer]
    assert found.area == pytest.approx(setting.truth.areas[sharer])
    assert found.vehicles == len(setting.truth.found_by(sharer))


@pytest.mark.parametrize("zones", [(), ((1e4, 1e4, 1.0),)], ids=["none", "far away"])
def test_where_nobody_sees_anything_the_answer_is_its_header(
    setting: Setting, zones: tuple[tuple[float, float, float], ...]
) -> None:
    found = setting.demand(with_zones(setting.match, *zones))
    assert found.answer(FEATURES) == found.answer(0) == ANSWER_HEADER
    assert (found.area, found.points) == (0.0, 0)
    assert found.vehicles <= 1  # the sharer itself
    assert found.request == 100 + 12 * len(zones)


def test_points_are_turned_into_the_world() -> None:
    sensors, points = np.zeros(2, SENSOR), np.zeros(3, POINT)
    sensors["vehicle"], sensors["first"], sensors["count"] = [4, 7], [0, 1], [1, 2]
    sensors["position"][1], sensors["heading"][1] = (10.0, 20.0, 2.0), np.pi / 2
    points["position"][1:] = [(3.0, 0.0, -2.0), (0.0, 1.0, 0.0)]
    scans = Scans(
        points=frame("LPTS", sensors, points.tobytes()), ego_points=b"", counts={4: 1, 7: 2}
    )
    assert scans.on_ground(7) == pytest.approx(np.array([[10.0, 23.0], [9.0, 20.0]]))


def test_curves_show_the_recommended_set_where_nothing_differs() -> None:
    starts = {one.name: one.start for one in INTERFACE.variables if one.name in DEFAULTS}
    assert starts == DEFAULTS
    for curve in SHARER_CURVES:
        assert RECOMMENDED in curve.sets.values()
        assert len(set(map(id, curve.sets.values()))) == len(curve.sets)
    assert not any(DEFAULTS.keys() & one.values.keys() for one in LADDER)
