"""Checkpoints: what is written is read, equal ones are equal bytes, others are refused."""

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint, read_network
from fmus.driving.network.driver import DrivingNetwork
from fmus.driving.network.fixed_point import rounded_weights
from orchestrator.errors import ComponentTypeError
from tests.fmus.driving.network.world import SMALL, changed, network

SIZES = st.integers(1, 500)


@given(
    keypoints=SIZES,
    spacing=SIZES,
    hidden=SIZES,
    vectors=st.integers(0, 50),
    cooperative=st.booleans(),
    early=st.booleans(),
)
def test_architectures_are_read_as_they_are_written(**sizes: Any) -> None:
    written = Architecture(features=100, **sizes)
    assert Architecture.of_text(written.as_text()) == written


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ({"keypoints": 0}, "`keypoints` is 0; it must be at least 1"),
        ({"vectors": -1}, "`vectors` is -1; it must be at least 0"),
        ({"vectors": 7}, "`features` is 12, too few for 7 `vectors` .* write at least 14"),
        ({"encoder": "cnn"}, "`encoder` is `cnn`"),
    ],
)
def test_sizes_that_make_no_network_are_refused(sizes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        changed(SMALL, **sizes)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    written = network()
    written.write(path)
    found = read_network(str(path))
    assert (found.architecture, found.origin) == (written.architecture, {"seed": "0"})
    assert set(found.weights) == set(written.weights)
    for name, value in written.weights.items():
        assert (found.weights[name] == value.astype(np.float32)).all()
        assert np.abs(rounded_weights(found.weights[name]) - rounded_weights(value)).max() <= 2**-12


def test_an_encoder_is_known_by_all_that_gives_features_their_meaning(tmp_path: Path) -> None:
    """By kind, vectors and each of its weights; not by what is behind it, nor how it is stored."""
    one = network()
    one.write(tmp_path / "a.safetensors")
    stored = read_network(str(tmp_path / "a.safetensors"))
    behind = {name: value + 1.0 for name, value in one.weights.items() if "encoder" not in name}
    backwards = dict(reversed([*one.weights.items()]))
    same = [dataclasses.replace(one, weights={**one.weights, **behind}, origin={}), stored]
    same += [dataclasses.replace(one, weights=backwards)]
    same += [dataclasses.replace(one, architecture=changed(keypoints=3, head=5))]
    assert {found.encoder for found in same} == {one.encoder}
    others = [dataclasses.replace(one, architecture=changed(vectors=0)), network(seed=1)]
    for name, value in one.weights.items():
        if name.startswith("encoder"):
            moved = value.copy()
            moved.flat[-1] += 1e-3
            others.append(dataclasses.replace(one, weights={**one.weights, name: moved}))
    turned = one.weights["encoder.place.weight"]  # the same bytes in another shape
    turned = turned.reshape(turned.shape[::-1])
    others.append(dataclasses.replace(one, weights={**one.weights, "encoder.place.weight": turned}))
    numbers = [found.encoder for found in (one, *others)]
    assert len(set(numbers)) == len(numbers) == 11
    assert all(0 < number < 2**64 for number in numbers)
    assert network(changed(early=True)).encoder == 0


def test_equal_checkpoints_are_equal_bytes(tmp_path: Path) -> None:
    """Whatever the order of weights and words; and a copy of a copy is the copy."""
    one = network()
    backwards = dataclasses.replace(
        one,
        weights=dict(reversed(list(one.weights.items()))),
        origin={"seed": "0", "learner": "bev"},
    )
    for k in range(5):
        dataclasses.replace(one, origin={"learner": "bev", "seed": "0"}).write(
            tmp_path / f"{k}.safetensors"
        )
    backwards.write(tmp_path / "5.safetensors")
    read_network(str(tmp_path / "0.safetensors")).write(tmp_path / "6.safetensors")
    assert len({path.read_bytes() for path in tmp_path.iterdir()}) == 1


def test_an_unknown_network_is_refused_with_the_known_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fmus.driving.network.checkpoint.SHIPPED", tmp_path)
    with pytest.raises(ComponentTypeError, match=r"`bvv`; give the path of .*nlosim train"):
        read_network("bvv")
    for name in ("bev-32", "bev-16"):
        network().write(tmp_path / f"{name}.safetensors")
    with pytest.raises(ComponentTypeError, match="choose one of bev-16, bev-32, or give the"):
        read_network("bvv")
    assert read_network("bev-16").architecture == SMALL


def damaged(path: Path, **changes: object) -> str:
    """A checkpoint with other metadata."""
    network().write(path)
    with safe_open(path, framework="numpy") as file:
        said = json.loads(file.metadata()["nlosim"]) | changes
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    save_file(tensors, path, metadata={"nlosim": json.dumps(said)})
    return str(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "other"}, "say the format `other`, not `nlosim-driving-1`"),
        ({"architecture": {}}, "does not say its architecture: .*keypoints"),
        ({"architecture": 3}, "does not say its architecture"),
        ({"architecture": SMALL.as_text() | {"hidden": "x"}}, "does not say its .*'x'"),
        ({"architecture": SMALL.as_text() | {"early": "2"}}, "`early` is `2`; it must be True or"),
        ({"architecture": SMALL.as_text() | {"hidden": math.inf}}, "`hidden` is inf, no text"),
        ({"architecture": SMALL.as_text() | {"legs": "2"}}, "does not say its .*legs"),
        (
            {"architecture": SMALL.as_text() | {"hidden": "5"}},
            r"`encoder.image.weight` has the shape \(576, 16\), not \(576, 5\)",
        ),
    ],
)
def test_files_that_say_something_else_are_refused(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    with pytest.raises(ComponentTypeError, match=message):
        read_network(damaged(tmp_path / "a.safetensors", **changes))


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    path.write_bytes(b"nothing")
    with pytest.raises(ComponentTypeError, match="cannot be read as a checkpoint"):
        read_network(str(path))
    save_file({"a": np.zeros(2)}, path)
    with pytest.raises(ComponentTypeError, match="is no checkpoint of a driving network"):
        read_network(str(path))
    save_file({"a": np.zeros(2)}, path, metadata={"nlosim": "{"})
    with pytest.raises(ComponentTypeError, match="is no checkpoint of a driving network"):
        read_network(str(path))
    one = network()
    weights = {n: w for n, w in one.weights.items() if n != "head.first.bias"}
    Checkpoint(architecture=SMALL, weights=weights, origin={}).write(path)
    with pytest.raises(ComponentTypeError, match=r"`head.first.bias` has the shape None, not \(10"):
        read_network(str(path))
    one.weights["head.first.bias"][3] = np.nan
    one.write(path)
    with pytest.raises(ComponentTypeError, match=r"`head.first.bias` has numbers that are not fin"):
        read_network(str(path))


def test_weights_too_large_for_exact_sums_are_refused() -> None:
    one = network()
    one.weights["head.first.weight"][:] = 1e9
    with pytest.raises(ValueError, match="weights are not finite, or too large"):
        DrivingNetwork(SMALL, one.weights)


def test_metadata_that_are_nested_too_deeply_are_none(tmp_path: Path) -> None:
    path = tmp_path / "deep.safetensors"
    save_file({"a": np.zeros(2)}, path, metadata={"nlosim": "[" * 100_000})
    with pytest.raises(ComponentTypeError, match="is no checkpoint of a driving network"):
        read_network(str(path))
