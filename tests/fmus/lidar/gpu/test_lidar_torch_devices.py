"""Nothing is computed beside the device; what a GPU would refuse is found without one."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode
from typing_extensions import override

from .harness import scan, town


def tensors(value: Any) -> Iterable[Tensor]:
    """The tensors in nested arguments."""
    if isinstance(value, Tensor):
        yield value
    elif isinstance(value, Mapping):
        yield from tensors(tuple(value.values()))
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for item in value:
            yield from tensors(item)


class Elsewhere(TorchFunctionMode):
    """Marks tensors that were sent to the device, and all that is computed from them.

    As on a GPU, tensors of both kinds do not mix (except single numbers), and NumPy cannot read
    marked ones before they are copied back.
    """

    def __init__(self) -> None:
        super().__init__()
        self.copies_back = 0
        self.calls = 0

    @override
    def __torch_function__(
        self,
        func: Callable[..., Any],
        types: Any,
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
    ) -> Any:
        options = kwargs or {}
        given = list(tensors((args, options)))
        marked = [t for t in given if hasattr(t, "is_elsewhere")]
        plain = [t for t in given if not hasattr(t, "is_elsewhere") and t.dim() > 0]
        name = getattr(func, "__name__", "")
        assert not (marked and plain), f"{name} of tensors on two devices"
        assert not (marked and name == "numpy"), "NumPy reads from the device"
        result = func(*args, **options)
        if name in {"to", "cpu"}:
            result = result.clone()
        self.copies_back += name == "cpu"
        is_made_there = not given and options.get("device") is not None
        if name != "cpu" and (marked or name == "to" or is_made_there):
            self.calls += 1
            for tensor in tensors(result):
                tensor.is_elsewhere = True  # type: ignore[attr-defined]
        return result


@pytest.mark.parametrize("tilt", [{}, {"pitch": 0.2}])
def test_everything_stays_on_the_device_until_the_points_are_copied(
    tilt: dict[str, float],
) -> None:
    scene = town(4, vehicles=40, buildings=8, sensors=3, heights=[2.0, 9.0])
    expected = scan("lidar-torch", scene, azimuths=180, **tilt)
    with Elsewhere() as device:
        assert scan("lidar-torch", scene, azimuths=180, **tilt) == expected
    assert device.calls > 100, "the mode saw the computation"
    assert device.copies_back == 2, "the points, and how many each sensor has; once per batch"


def test_the_mode_finds_what_is_beside_the_device() -> None:
    there = torch.device("cpu")
    with Elsewhere():
        a = torch.arange(3).to(there)
        b = torch.arange(3, device=there) + a
        assert (b * 2).cpu().numpy().tolist() == [0, 4, 8]
        with pytest.raises(AssertionError, match="two devices"):
            a + torch.arange(3)
        with pytest.raises(AssertionError, match="NumPy reads"):
            np.asarray(a[1:].numpy())
