"""Checkpoints: the weights of a driving network and its shape, in a safetensors file."""

import hashlib
import importlib.util
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from fmus.driving.network.architecture import POINT_TRANSFORMER, Architecture
from fmus.driving.network.point_transformer_shapes import VARIANCE
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array

SHIPPED: Final = Path(__file__).parent / "checkpoints"
"""The folder of the networks that come with the package."""
_SUFFIX: Final = ".safetensors"
_FORMAT: Final = "nlosim-driving-1"
_ENCODER: Final = "encoder."
"""How the names of an encoder's weights begin."""
_METADATA: Final = "nlosim"
"""The one key of the metadata, so that their order, which safetensors leaves open, is no matter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checkpoint:
    """A driving network as it is stored.

    Attributes:
        architecture: its shape.
        weights: float64, by the names of `Architecture.shapes`.
        origin: how it was made, for people: recipe, seed, commit.
    """

    architecture: Architecture
    weights: Mapping[str, Array]
    origin: Mapping[str, str]

    @property
    def encoder(self) -> int:
        """Which encoder it has, as it stands in its features messages; 0: others send raw points.

        8 bytes of the SHA-256 of all that gives features their meaning: the encoder's kind, how
        many vectors are among the features, and its weights. Networks that differ behind the
        encoder understand each other's features.
        """
        if self.architecture.early:
            return 0
        digest = hashlib.sha256(f"{self.architecture.encoder} {self.architecture.vectors}".encode())
        for name in sorted(name for name in self.weights if name.startswith(_ENCODER)):
            weights = np.asarray(self.weights[name], "<f4", order="C")
            digest.update(f" {name} {list(weights.shape)} ".encode())
            digest.update(weights.tobytes())
        return int.from_bytes(digest.digest()[:8], "little")

    def write(self, path: Path) -> None:
        """Write the file; weights as float32. Equal checkpoints are equal bytes."""
        tensors = {name: np.asarray(value, np.float32) for name, value in self.weights.items()}
        said = {
            "format": _FORMAT,
            "architecture": self.architecture.as_text(),
            "origin": dict(self.origin),
        }
        path.write_bytes(save(tensors, metadata={_METADATA: json.dumps(said, sort_keys=True)}))


def shipped() -> list[str]:
    """Names of the networks that come with the package."""
    return sorted(path.stem for path in SHIPPED.glob(f"*{_SUFFIX}"))


def shipped_or_none() -> list[str]:
    """Names of the networks that come with the package, and the empty one, for no network."""
    return ["", *shipped()]


def read_network(name: str | Path) -> Checkpoint:
    """The network of a name, or in a file.

    Args:
        name: of a network that comes with the package, or the path of a checkpoint.

    Raises:
        ComponentTypeError: there is none, it is none of a driving network, or it needs PyTorch,
            which is not installed. Its text begins with `network`, the parameter of that name.
    """
    try:
        return _read(name)
    except ComponentTypeError as error:
        raise ComponentTypeError(f"`network`: {error}") from error.__cause__


def _read(name: str | Path) -> Checkpoint:
    path = SHIPPED / f"{name}{_SUFFIX}"
    if name not in shipped():
        path = Path(name)
        if path.suffix != _SUFFIX or not path.is_file():
            choice = f"choose one of {', '.join(shipped())}, or " if shipped() else ""
            raise ComponentTypeError(
                f"there is no network `{name}`; {choice}give the path of a checkpoint that "
                f"`nlosim train` has made (*{_SUFFIX})"
            )
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            weights = {key: file.get_tensor(key).astype(np.float64) for key in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise ComponentTypeError(f"`{path}` cannot be read as a checkpoint: {error}") from error
    found = _checked(path, _said(metadata), weights)
    require_installed(found.architecture)
    return found


def require_installed(architecture: Architecture) -> None:
    """Refuse an encoder whose library is missing, without importing it.

    Raises:
        ComponentTypeError: PyTorch is not installed.
    """
    if architecture.encoder == POINT_TRANSFORMER and importlib.util.find_spec("torch") is None:
        raise ComponentTypeError(
            "this network's encoder is a point transformer, which needs PyTorch; run "
            "`pip install 'nlosim[torch]'`, or take a network with the encoder `bev`"
        )


def _said(metadata: Mapping[str, str]) -> Mapping[str, Any]:
    """Format, architecture and origin, which are one text; empty if there is none."""
    try:
        said = json.loads(metadata.get(_METADATA, ""))
    except (ValueError, RecursionError):
        said = None
    return said if isinstance(said, dict) else {}


def _checked(path: Path, said: Mapping[str, Any], weights: Mapping[str, Array]) -> Checkpoint:
    if said.get("format") != _FORMAT:
        raise ComponentTypeError(
            f"`{path}` is no checkpoint of a driving network: its metadata say the format "
            f"`{said.get('format')}`, not `{_FORMAT}`"
        )
    try:
        architecture = Architecture.of_text(dict(said.get("architecture", {})))
        origin = {str(k): str(v) for k, v in dict(said.get("origin", {})).items()}
    except (TypeError, ValueError) as error:
        raise ComponentTypeError(f"`{path}` does not say its architecture: {error}") from error
    for name, shape in architecture.shapes.items():
        found = weights[name].shape if name in weights else None
        if found != shape:
            raise ComponentTypeError(f"`{path}`: `{name}` has the shape {found}, not {shape}")
        if not np.isfinite(weights[name]).all():
            raise ComponentTypeError(f"`{path}`: `{name}` has numbers that are not finite")
        if name.endswith(VARIANCE) and (weights[name] < 0.0).any():
            raise ComponentTypeError(f"`{path}`: `{name}` has variances below 0")
    return Checkpoint(architecture=architecture, weights=weights, origin=origin)
