"""Where to learn."""

import importlib

from orchestrator.errors import CosimError


class DeviceError(CosimError):
    """The device that the training file asks for is not there. Exit code 2."""


def resolve(device: str) -> str:
    """`cpu` or `cuda`.

    Args:
        device: `cpu`, `cuda`, or `auto` for the GPU where there is one.

    Raises:
        DeviceError: `cuda` is asked for, and PyTorch finds none.
    """
    if device == "cpu":
        return device
    try:
        torch = importlib.import_module("torch")
    except ImportError:
        if device == "auto":
            return "cpu"
        what = "`device: cuda` needs PyTorch: pip install 'nlosim[train]'"
        raise DeviceError(what) from None
    if torch.cuda.is_available():
        return "cuda"
    if device == "auto":
        return "cpu"
    what = (
        "PyTorch finds no GPU for `device: cuda`; write `device: auto`, which takes what there is"
    )
    raise DeviceError(what)
