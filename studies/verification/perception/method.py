"""What is compared, and how, in words; text for people."""

import textwrap
from collections.abc import Mapping
from typing import Any, Final

from fmus.facilities.answers import ANSWER_HEADER
from fmus.facilities.zones import ZONE_SIZE
from studies.verification.perception.bytes_on_air import (
    FEATURES,
    RAW_POINT,
    REQUEST,
    SMALL_FEATURES,
)
from studies.verification.perception.parameter_set import LADDER, ParameterSet
from studies.verification.perception.summary import DEMAND, NOTHING, RIGHT
from studies.verification.perception.truth import Interest

_WIDTH: Final = 98


def wrapped(part: str) -> str:
    """Break paragraphs and lists into lines; tables stay as they are."""
    if part.startswith("|"):
        return part
    return "\n".join(
        textwrap.fill(
            line,
            _WIDTH,
            subsequent_indent="  " if line.startswith("* ") else "",
            break_long_words=False,
            break_on_hyphens=False,
        )
        for line in part.splitlines()
    )


def section(*parts: str) -> str:
    """Join headings, paragraphs, lists and tables to a part of a page."""
    return "\n\n".join(map(wrapped, parts)) + "\n"


def whole_percent(share: float) -> str:
    """Write a share in whole per cent."""
    return f"{100 * share:.0f} %"


TUNING_SEED: Final = 1000
"""Seed of the scenes that the parameter sets were chosen on."""

_METHOD: Final = """\
## What is compared

**Scenes.** Two to four arms with one to three lanes of 3.2 m per direction, skewed by up to 15
deg, bent by up to 10 deg; between each two arms nothing, rows of houses (8 to 18 m deep, with
alleys, round the corner and thus not convex) or solid blocks, 1.5 to 14 m from the road; one
scene in five has no houses. Queues before red lights, moving traffic with exponential gaps,
vehicles on their way through the junction; 50 % cars, 20 % SUVs, 12 % vans, 7 % buses, 11 %
trucks; none overlap. The ego vehicle, a car or SUV, is 4 to 40 m before the stop line and drives
straight on, left or right. 2 to 10 of the vehicles within 80 m of it are equipped. Scene number k
of a seed is always the same.

**One scan.** Every equipped vehicle scans once, with the lidar's default noise. All matrices
reach the ego vehicle: what the radio loses is another question. There is no history, hence no
hysteresis.

**Truth.** The shadow that each building and each part of each body (the prisms of [the lidar
model](physics-lidar.md)) casts on the ground is an exact polygon: finite if it is lower than the
sensor, endless if not. *Known* to a vehicle is the ground within its range of 50 m and beyond the
ring below its lowest channel (h / tan 20 deg) that lies in no shadow; its own footprint; and the
footprints of the vehicles that it sees: **an occupied spot is not hidden**. A vehicle is seen if
a quarter of 24 points on it are in sight. The tests compare both with single rays.

**Hidden** is the part of the ego vehicle's area of interest that it does not know: the road
surface within {corridor:g} m of its route, beyond the ring and within {horizon:g} m. What a
candidate *reveals* is the part of that which it knows. The area of interest stays the same when
parameters vary, so that a set with another `corridor` or `horizon` is judged by the same
question.

**Index.** With `points` it is the paper's, a number of points; its T1 is such a number. With
`seen_area` it is the share of the cell's ground that the scan shows, in `index_levels` steps, and
T1 (`seen_threshold`) is such a share.

**Blind zones** are compared by area, within the area of interest, over all scenes together:
precision = hidden part of the zones, recall = part of what is hidden that is in zones, IoU =
both.

**Sharers.** Only scenes with demand count: somebody reveals {demand:g} m^2 or more. A sharer is
*best* if nobody reveals more, *right* if it reveals {right} of what the best one does (second
places are often equal for all practical purposes). Without a trigger there is no sharer:
*missed*, which is wrong. *False* are triggers in scenes in which nobody reveals {nothing:g} m^2;
what is between counts as neither. A random candidate never misses, and always triggers.

**Exact matrices** say how much the resolution costs: every vehicle knows exactly which share of
each of its cells it sees, and the ego vehicle expects from a candidate the sum of (its own unseen
share) x (the candidate's seen share) x area. No index of any kind can do better without knowing
where in a cell the seen part is.

**Bytes** of one scan, above the lower layers. APMM: the matrices of all equipped vehicles, and if
there is a trigger a request and the answer of one sharer. *Demanded* is `answer: demanded` of
[`facilities`](physics-sharing.md): the request, one per scan, has {request} bytes and {zone} for
each blind zone, the answer a header of {header} and the share of the sensor data that lies in the
zones, computed by `facilities` itself from the zones that the perception unit found and the
matrix that the sharer sent. It reveals what is hidden and in a zone, and tells about hidden
vehicles whose boxes reach into one. *Whole* is `answer: all`: a request of {request} bytes and a
whole scan. Always-on: the sensor data of all equipped vehicles. CPM: a collective perception
message of every equipped vehicle (ETSI TS 103 324, in real bits) with all objects that its
perception detects, as if each were due; the generation rules send less. Sensor data of one scan:
features of {features} or {small} bytes, or {raw} bytes per lidar point, of which the demanded
answer has those in the zones. There is one ego vehicle per scene: with several, each needs its
sharer and its answer, so that requests and answers grow with their number.

CPMs tell about objects, not about free ground: they reveal no area. For all of them, *hidden
vehicles* is the share of the vehicles in the area of interest that the ego vehicle does not see
of which it learns: from the sharer's view, or from all views; senders tell about themselves.

## Parameter sets

{sets}

They were chosen on scenes of seed {tuning}, not on those of this page.

## What is not in the comparison

* Pedestrians and cyclists, kerbs, poles, trees: real streets hide more.
* The scenes are drawn, not recorded: shares hold for this mix of junctions and traffic. Traffic
  is denser than average, because hidden road is the subject.
* Truth calls ground visible that falls between two scan rings, up to 4 m apart at 35 m; a matrix
  of points cannot know that it is.
* Features are taken as divisible: each of them belongs to a place. A network whose features do not
  cannot be asked for a part of them.
* A sharer answers with what its perception believes to lie in the zones. With pose errors, what is
  revealed is counted as if it cut its scan without them.
* The rim of what a body hides is sharp. A lidar's beam is not.
"""


def method_text() -> str:
    """What is compared, and how; the last part of the page."""
    interest = Interest()
    text = _METHOD.format(
        corridor=interest.corridor,
        horizon=interest.horizon,
        demand=DEMAND,
        nothing=NOTHING,
        right=whole_percent(RIGHT),
        features=FEATURES,
        small=SMALL_FEATURES,
        raw=RAW_POINT,
        request=REQUEST,
        zone=ZONE_SIZE,
        header=ANSWER_HEADER,
        sets="\n".join(wrapped(_set(one)) for one in LADDER),
        tuning=TUNING_SEED,
    )
    return "\n\n".join(map(_filled, text.split("\n\n")))


def _filled(part: str) -> str:
    """Break a paragraph again whose lines changed their lengths when it was filled in."""
    return part if part.startswith(("#", "* ")) else wrapped(" ".join(part.split()))


def _set(one: ParameterSet) -> str:
    values: Mapping[str, Any] = one.values
    listed = ", ".join(f"`{key}` {_value(value)}" for key, value in values.items())
    road = "with `road.vertex`" if one.uses_road else "without `road.vertex`"
    return f"* **{one.name}**: {road}; {listed}."


def _value(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower()
