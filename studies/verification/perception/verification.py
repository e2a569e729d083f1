"""Plays scenes, and judges the perception unit by all of them."""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from tqdm import tqdm

from studies.verification.perception.bytes_on_air import FEATURES, SMALL_FEATURES
from studies.verification.perception.generator import MANY
from studies.verification.perception.parameter_set import RECOMMENDED, ParameterSet
from studies.verification.perception.scoring import Played, SceneResult, play
from studies.verification.perception.session import UnitsUnderTest
from studies.verification.perception.summary import (
    DEMAND,
    RIGHT,
    WHOLE,
    SharerScore,
    by_cells,
    byte_share,
    chosen_by,
    nearest,
    parts,
    score_random,
    score_sharers,
    traffic,
    zone_areas,
)
from studies.verification.perception.truth import CELLS

TARGET_RIGHT: Final = 0.95
"""Share of the scenes with demand in which the sharer is to be right."""
TARGET_BYTES: Final = 0.05
"""Largest share of the bytes of always-on sharing."""
DATA_SIZES: Final[Mapping[str, int]] = {
    "features": FEATURES,
    "features, half": SMALL_FEATURES,
    "raw points": 0,
}
"""Bytes of sensor data that are compared; 0: as many as there are points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What playing many scenes found.

    Attributes:
        seed: of the scenes.
        results: of those that were played, by ascending number.
        crowded: further ones with many candidates, with the recommended parameters only.
        examples: two of them in full: the first with a right sharer, and with a wrong one.
        is_complete: whether nobody stopped it.
    """

    seed: int
    results: Sequence[SceneResult]
    crowded: Sequence[SceneResult]
    examples: Sequence[Played]
    is_complete: bool

    @property
    def recommended(self) -> SharerScore:
        """The score of the recommended parameters."""
        return self.score(RECOMMENDED)

    def score(self, choice: ParameterSet) -> SharerScore:
        """The score of one parameter set."""
        return score_sharers(self.results, chosen_by(choice.name))

    def baselines(self) -> dict[str, SharerScore]:
        """The scores of simple choices, and of the bounds of the resolution, by name."""
        scores = {
            "random candidate": score_random(self.results),
            "nearest candidate": score_sharers(self.results, nearest),
        }
        for cell in CELLS:
            name = f"exact matrix, {cell:g} m"
            scores[name] = score_sharers(self.results, by_cells(cell))
        return scores

    @property
    def byte_share(self) -> float:
        """Bytes of the recommended parameters over those of always-on sharing, of features.

        Answers have what was demanded.
        """
        return byte_share(self.results, RECOMMENDED.name, FEATURES)

    @property
    def whole_share(self) -> float:
        """Bytes of the recommended parameters over those of always-on sharing, of features.

        Answers are whole scans.
        """
        return byte_share(self.results, RECOMMENDED.name, FEATURES, WHOLE)

    @property
    def passes(self) -> bool:
        """Whether both targets are met."""
        return self.recommended.right >= TARGET_RIGHT and self.byte_share <= TARGET_BYTES

    def by_candidates(self) -> dict[str, list[SceneResult]]:
        """All scenes, crowded ones too, by how many candidates they have."""
        groups: dict[str, list[SceneResult]] = {"2-3": [], "4-5": [], "6-7": [], "8-10": []}
        for one in self.results:
            k = one.candidates
            name = "2-3" if k <= 3 else "4-5" if k <= 5 else "6-7" if k <= 7 else "8-10"
            groups[name].append(one)
        groups[f"{MANY.fewest}-{MANY.most}"] = list(self.crowded)
        return {name: group for name, group in groups.items() if group}

    def as_data(self) -> dict[str, Any]:
        """What `--json` prints."""
        names = {name for one in self.results[:1] for name in one.choices}
        data = {
            "pass": self.passes,
            "seed": self.seed,
            "scenes": len(self.results),
            "complete": self.is_complete,
            "right_sharer": self.recommended.right,
            "byte_share": self.byte_share,
            "byte_share_whole": self.whole_share,
            "targets": {"right_sharer": TARGET_RIGHT, "byte_share": TARGET_BYTES},
            "crowded": {
                "scenes": len(self.crowded),
                **asdict(score_sharers(self.crowded, chosen_by(RECOMMENDED.name))),
                **_byte_shares(self.crowded, RECOMMENDED.name),
            },
            "by_candidates": {
                name: {
                    "scenes": len(group),
                    "right": score_sharers(group, chosen_by(RECOMMENDED.name)).right,
                    **_byte_shares(group, RECOMMENDED.name),
                }
                for name, group in self.by_candidates().items()
            },
            "sets": {name: self._set_data(name) for name in sorted(names)},
            "baselines": {name: asdict(score) for name, score in self.baselines().items()},
            "bytes": {
                size: {
                    way: asdict(one)
                    for way, one in traffic(self.results, RECOMMENDED.name, data).items()
                }
                for size, data in DATA_SIZES.items()
            },
            "demanded": {
                size: asdict(parts(self.results, RECOMMENDED.name, data))
                for size, data in DATA_SIZES.items()
            },
        }
        return {key: _without_nan(value) for key, value in data.items()}

    def _set_data(self, name: str) -> dict[str, Any]:
        areas = zone_areas(self.results, name)
        return {
            **asdict(score_sharers(self.results, chosen_by(name))),
            "precision": areas.precision,
            "recall": areas.recall,
            "iou": areas.iou,
            **_byte_shares(self.results, name),
        }


def _byte_shares(results: Sequence[SceneResult], name: str) -> dict[str, float]:
    """The shares of bytes with features, for demanded and for whole answers."""
    return {
        "byte_share": byte_share(results, name, FEATURES),
        "byte_share_whole": byte_share(results, name, FEATURES, WHOLE),
    }


def _without_nan(value: Any) -> Any:
    """Put None for shares of nothing, which JSON cannot say otherwise."""
    if isinstance(value, dict):
        return {key: _without_nan(member) for key, member in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value


def verify(
    units: UnitsUnderTest, *, seed: int, scenes: int, sets: Sequence[ParameterSet]
) -> Verification:
    """Play scenes number 0 to `scenes` - 1, and a tenth as many with many candidates.

    Ctrl-C ends it with those played until then.

    Raises:
        ComponentError: a unit failed.
    """
    results: list[SceneResult] = []
    crowded: list[SceneResult] = []
    examples: dict[bool, Played] = {}
    more = -(-scenes // 10)
    is_complete = False
    try:
        with tqdm(total=scenes + more, unit="scene", file=sys.stderr, disable=None) as bar:
            for number in range(scenes):
                played = play(units, seed, number, sets)
                results.append(played.result)
                if _is_telling(played):
                    examples.setdefault(_is_right(played.result), played)
                bar.update()
            for number in range(more):
                crowded.append(play(units, seed, number, (RECOMMENDED,), MANY).result)
                bar.update()
        is_complete = True
    except KeyboardInterrupt:
        pass
    chosen = [examples[right] for right in (True, False) if right in examples]
    return Verification(
        seed=seed, results=results, crowded=crowded, examples=chosen, is_complete=is_complete
    )


def _is_right(result: SceneResult) -> bool:
    sharer = result.choices[RECOMMENDED.name].sharer
    return sharer is not None and result.areas[sharer] >= RIGHT * result.best


def _is_telling(played: Played) -> bool:
    """Whether it makes a good picture: a junction with houses, and something to reveal."""
    return len(played.scene.buildings) > 2 and played.result.best > 4 * DEMAND
