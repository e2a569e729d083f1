"""Weights come back from files as they were; other files are refused."""

from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

from fmus.driving.point_transformer.checkpoint import load, save
from fmus.driving.point_transformer.encoder import PointTransformerEncoder
from fmus.driving.point_transformer.sampling import FirstPoints

from .clouds import cloud

METADATA = {"nlosim": "point transformer; version=1; blocks=2"}


@pytest.mark.parametrize("blocks", [2, 3])
def test_an_encoder_comes_back_with_its_statistics(tmp_path: Path, blocks: int) -> None:
    encoder = PointTransformerEncoder(blocks=blocks, seed=8)
    encoder(cloud(clouds=2))  # in training mode: moves the statistics
    save(encoder.eval(), tmp_path / "weights")
    again = load(tmp_path / "weights")
    assert not again.training
    before, after = encoder.state_dict(), again.state_dict()
    assert before.keys() == after.keys()
    assert all(torch.equal(before[name], after[name]) for name in before)
    with torch.inference_mode():
        assert torch.equal(again(cloud()).features, encoder(cloud()).features)


def test_equal_encoders_make_equal_files_and_the_sampling_is_chosen_when_loading(
    tmp_path: Path,
) -> None:
    for name in ("a", "b"):
        save(PointTransformerEncoder(seed=8), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert load(tmp_path / "a", sampling=FirstPoints()).sampling == FirstPoints()


def test_files_that_cannot_be_read_or_written_are_named(tmp_path: Path) -> None:
    for path in (tmp_path / "absent", tmp_path):
        with pytest.raises(OSError, match=f"{path.name} is no file"):
            load(path)
    with pytest.raises(OSError, match="absent/weights cannot be written"):
        save(PointTransformerEncoder(), tmp_path / "absent" / "weights")


@pytest.mark.parametrize("content", [b"", b"no tensors", b"\x80\x04cos\nsystem\n"])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "weights"
    path.write_bytes(content)
    with pytest.raises(ValueError, match="weights is no safetensors file, or not all of one"):
        load(path)


def test_a_file_cut_short_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "weights"
    save(PointTransformerEncoder(), path)
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(ValueError, match="not all of one"):
        load(path)


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({}, "weights holds tensors of another program; this program reads `point transformer"),
        ({"nlosim": "bev"}, "weights holds bev; this program reads"),
        (
            {"nlosim": "point transformer; version=2; blocks=2"},
            "holds point transformer; version=2",
        ),
        ({"nlosim": "point transformer; version=1; blocks=3"}, "lacks the tensor `attention.3"),
    ],
)
def test_another_network_is_refused(tmp_path: Path, metadata: dict[str, str], message: str) -> None:
    path = tmp_path / "weights"
    save_file(dict(PointTransformerEncoder().state_dict()), path, metadata)
    with pytest.raises(ValueError, match=message):
        load(path)


def test_tensors_that_do_not_fit_are_named(tmp_path: Path) -> None:
    path, name = tmp_path / "weights", "attention.0.query.weight"
    save(PointTransformerEncoder(), path)
    good = load_file(path)
    for bad, message in (
        (good[name][:3], rf"`{name}` is torch.float32 of shape \(3, 32\), not torch.float32"),
        (good[name].double(), rf"`{name}` is torch.float64"),
        (good[name] * torch.nan, rf"`{name}` has numbers that are not finite"),
    ):
        save_file({**good, name: bad.contiguous()}, path, METADATA)
        with pytest.raises(ValueError, match=message):
            load(path)
    save_file({**good, "surplus": good[name].clone()}, path, METADATA)
    with pytest.raises(ValueError, match="has the tensor `surplus`, which the network does not"):
        load(path)
