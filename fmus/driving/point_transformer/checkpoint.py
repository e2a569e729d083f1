"""Weights in files: safetensors, which hold numbers only and run no code when read."""

from pathlib import Path
from typing import Final

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from fmus.driving.point_transformer.encoder import PointTransformerEncoder
from fmus.driving.point_transformer.sampling import Sampling

_KEY: Final = "nlosim"


def _content(blocks: int) -> str:
    """What the metadata say under the key: one entry, as safetensors would shuffle several."""
    return f"point transformer; version=1; blocks={blocks}"


def save(encoder: PointTransformerEncoder, path: Path) -> None:
    """Write the weights, the statistics of the batch normalisation, and the number of blocks.

    Equal encoders make equal files.

    Raises:
        OSError: the file cannot be written.
    """
    tensors = {name: value.contiguous() for name, value in encoder.state_dict().items()}
    try:
        save_file(tensors, path, {_KEY: _content(encoder.blocks)})
    except SafetensorError as error:
        raise OSError(f"{path} cannot be written: {error}") from error


def load(path: Path, *, sampling: Sampling | None = None) -> PointTransformerEncoder:
    """The encoder of a file, on the CPU, for inference.

    Args:
        path: that `save` wrote.
        sampling: which points become keypoints, no part of the file; by default the farthest.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no point transformer, or not all of one.
    """
    content, tensors = _read(path)
    known = {_content(blocks): blocks for blocks in (2, 3)}
    if content not in known:
        raise ValueError(
            f"{path} holds {content or 'tensors of another program'}; this program reads "
            + " and ".join(f"`{name}`" for name in known)
        )
    encoder = PointTransformerEncoder(blocks=known[content], sampling=sampling)
    _check(path, tensors, encoder.state_dict())
    encoder.load_state_dict(tensors)
    return encoder.eval()


def _read(path: Path) -> tuple[str, dict[str, Tensor]]:
    """What the metadata call it, empty if nothing; and the tensors."""
    if not path.is_file():
        raise FileNotFoundError(f"{path} is no file")
    try:
        with safe_open(path, framework="pt") as file:
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            return (file.metadata() or {}).get(_KEY, ""), tensors
    except SafetensorError as error:
        raise ValueError(f"{path} is no safetensors file, or not all of one: {error}") from error


def _check(path: Path, tensors: dict[str, Tensor], expected: dict[str, Tensor]) -> None:
    """Refuse missing, unknown, misshapen and broken tensors; names the first."""
    for name in sorted(expected.keys() | tensors.keys()):
        if name not in tensors:
            raise ValueError(f"{path} lacks the tensor `{name}`")
        if name not in expected:
            raise ValueError(f"{path} has the tensor `{name}`, which the network does not")
        given, wanted = tensors[name], expected[name]
        if given.shape != wanted.shape or given.dtype != wanted.dtype:
            raise ValueError(
                f"{path}: `{name}` is {given.dtype} of shape {tuple(given.shape)}, not "
                f"{wanted.dtype} of shape {tuple(wanted.shape)}"
            )
        if not bool(torch.isfinite(given).all()):
            raise ValueError(f"{path}: `{name}` has numbers that are not finite")
