"""The shape of a driving network, and the names of its weights."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

from fmus.driving.network.patches import INPUTS
from fmus.driving.network.point_transformer_shapes import (
    BLOCKS,
    LEAST_KEYPOINTS,
    cloud_size,
    tensors,
)

BEV: Final = "bev"
POINT_TRANSFORMER: Final = "point-transformer"
GEOMETRY: Final = 7
"""Numbers that the receiver adds to a keypoint; see `fmus.driving.network.fusion.geometry`."""
PLACE: Final = 3
"""Numbers that the encoder adds to an image, where it is: `fmus.driving.network.encoder.place`."""
EGO: Final = 12
"""Numbers about the ego vehicle; see `fmus.driving.network.driver.ego_numbers`."""
JUDGEMENTS: Final = 2
"""How sure the encoder is that a place is a vehicle, and a moving one; their sum is saliency."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Architecture:
    """Sizes of a driving network.

    Attributes:
        keypoints: of a complete message.
        features: of a keypoint; 128 or 256 of a point transformer.
        vectors: among the features, vectors in the plane; two numbers each, the last ones; a point
            transformer has none.
        spacing: blocks of 0.8 m, of each square of which one keypoint is taken.
        hidden: units of the encoder's first layer.
        fused: units of the fusion's first layer.
        pooled: units of its second one, of which the maximum over all keypoints is taken.
        head: units of the head's first layer.
        cooperative: whether messages of others are used.
        encoder: `bev`, or `point-transformer`.
        early: whether others send raw points, which are laid over the own ones before encoding.

    Raises:
        ValueError: there is no such encoder, or these sizes make no network of its kind.
    """

    keypoints: int
    features: int
    vectors: int = 16
    spacing: int = 1
    hidden: int = 96
    fused: int = 96
    pooled: int = 64
    head: int = 64
    cooperative: bool = True
    encoder: str = "bev"
    early: bool = False

    def __post_init__(self) -> None:
        if self.encoder not in {BEV, POINT_TRANSFORMER}:
            raise ValueError(
                f"`encoder` is `{self.encoder}`; it must be `{BEV}` or `{POINT_TRANSFORMER}`"
            )
        self._check_sizes()
        if self.encoder == POINT_TRANSFORMER:
            self._check_point_transformer()

    @property
    def points(self) -> int:
        """Points of a scan that a point transformer reads."""
        return cloud_size(self.keypoints, self.blocks)

    @property
    def blocks(self) -> int:
        """How often a point transformer down-samples."""
        return BLOCKS[self.features]

    @property
    def shapes(self) -> Mapping[str, tuple[int, ...]]:
        """Shapes of all weights by name, inputs before outputs but in a point transformer."""
        encoder = self._bev_shapes if self.encoder == BEV else tensors(self.blocks)
        return {**encoder, **self.decision_shapes}

    @property
    def _bev_shapes(self) -> Mapping[str, tuple[int, ...]]:
        return {
            "encoder.image.weight": (INPUTS, self.hidden),
            "encoder.place.weight": (PLACE, self.hidden),
            "encoder.place.bias": (self.hidden,),
            "encoder.features.weight": (self.hidden, self.features),
            "encoder.features.bias": (self.features,),
            "encoder.judgements.weight": (self.hidden, JUDGEMENTS),
            "encoder.judgements.bias": (JUDGEMENTS,),
        }

    @property
    def decision_shapes(self) -> Mapping[str, tuple[int, ...]]:
        """Shapes of the weights of fusion and head, whatever the encoder; inputs before outputs."""
        return {
            "fusion.first.weight": (self.features + GEOMETRY, self.fused),
            "fusion.first.bias": (self.fused,),
            "fusion.second.weight": (self.fused, self.pooled),
            "fusion.second.bias": (self.pooled,),
            "head.first.weight": (self.pooled + EGO, self.head),
            "head.first.bias": (self.head,),
            "head.second.weight": (self.head, 3),
            "head.second.bias": (3,),
        }

    @property
    def dimensions(self) -> int:
        """Features of a keypoint on the air."""
        return 0 if self.early else self.features

    def as_text(self) -> dict[str, str]:
        """All sizes as texts by name, for the metadata of a checkpoint."""
        return {f.name: str(getattr(self, f.name)) for f in fields(self)}

    @classmethod
    def of_text(cls, texts: Mapping[str, str]) -> "Architecture":
        """What `as_text` wrote; what is missing takes its default.

        Raises:
            TypeError: a size is missing, or is none of an architecture.
            ValueError: a value is none of its kind, or the sizes make no network.
        """
        kinds = {field.name: field.type for field in fields(cls)}
        values: dict[str, Any] = {}
        for name, text in texts.items():
            values[name] = _value(name, text, kinds.get(name))
        return cls(**values)

    def _check_sizes(self) -> None:
        sizes = {f.name: getattr(self, f.name) for f in fields(self) if f.type is int}
        for name, size in sizes.items():
            least = 0 if name == "vectors" else 1
            if size < least:
                raise ValueError(f"`{name}` is {size}; it must be at least {least}")
        if 2 * self.vectors > self.features:
            raise ValueError(
                f"`features` is {self.features}, too few for {self.vectors} `vectors` of two "
                f"numbers each; write at least {2 * self.vectors}"
            )

    def _check_point_transformer(self) -> None:
        problems = []
        if self.features not in BLOCKS:
            problems.append(f"`features` are {self.features}; they must be 128 or 256")
        if self.keypoints < LEAST_KEYPOINTS:
            problems.append(
                f"`keypoints` are {self.keypoints}; they must be at least {LEAST_KEYPOINTS}"
            )
        if self.vectors:
            problems.append(f"`vectors` are {self.vectors}; they must be 0")
        if self.early:
            problems.append("`early` is true; others can only send keypoints")
        if problems:
            raise ValueError("of a point transformer, " + "; ".join(problems))


def _value(name: str, text: object, kind: object) -> str | int | bool:
    if not isinstance(text, str):
        raise TypeError(f"`{name}` is {text!r:.40}, no text")
    if kind is bool:
        if text not in {"True", "False"}:
            raise ValueError(f"`{name}` is `{text}`; it must be True or False")
        return text == "True"
    return int(text) if kind is int else text
