"""Names and shapes of a point transformer's tensors in a checkpoint; read without PyTorch."""

import itertools
from collections.abc import Iterator, Mapping
from typing import Final

PREFIX: Final = "encoder.point_transformer."
"""The names of its tensors begin with this; what follows is their name in PyTorch."""
BLOCKS: Final[Mapping[int, int]] = {128: 2, 256: 3}
"""How often points are down-sampled, by the features of a keypoint."""
LEAST_KEYPOINTS: Final = 16
"""A scan has no fewer keypoints, because a keypoint has so many neighbours."""
_EMBEDDING: Final = 32
_REDUCTION: Final = 4
VARIANCE: Final = "running_var"
"""How names of variances end."""
_NORMALISATION: Final = ("weight", "bias", "running_mean", VARIANCE)


def cloud_size(keypoints: int, blocks: int) -> int:
    """Points of a scan of which so many keypoints are left."""
    return keypoints * int(_REDUCTION**blocks)


def tensors(blocks: int) -> Mapping[str, tuple[int, ...]]:
    """Shapes as PyTorch has them, outputs before inputs, by name with the prefix."""
    return {PREFIX + name: shape for name, shape in _tensors(blocks)}


def _tensors(blocks: int) -> Iterator[tuple[str, tuple[int, ...]]]:
    inner = _EMBEDDING
    widths = [_EMBEDDING << level for level in range(blocks + 1)]
    yield from _linear("embedding.0", 3, inner)
    yield from _linear("embedding.2", inner, inner)
    for k, (width, wider) in enumerate(itertools.pairwise(widths)):
        for layer, inputs in ((0, 3 + width), (3, wider)):
            yield f"down.{k}.network.{layer}.weight", (wider, inputs)
            for part in _NORMALISATION:
                yield f"down.{k}.network.{layer + 1}.{part}", (wider,)
    for k, width in enumerate(widths):
        yield from _linear(f"attention.{k}.into", width, inner)
        for name in ("query", "key", "value"):
            yield f"attention.{k}.{name}.weight", (inner, inner)
        yield from _linear(f"attention.{k}.position.0", 3, inner)
        yield from _linear(f"attention.{k}.position.2", inner, inner)
        yield from _linear(f"attention.{k}.weight.0", inner, inner)
        yield f"attention.{k}.weight.2.weight", (inner, inner)
        yield f"attention.{k}.out.weight", (width, inner)


def _linear(name: str, inputs: int, outputs: int) -> Iterator[tuple[str, tuple[int, ...]]]:
    yield f"{name}.weight", (outputs, inputs)
    yield f"{name}.bias", (outputs,)
