"""Several experiments on one machine at a time."""

import socket
from pathlib import Path

import pytest

from orchestrator.campaign.workers import local_workers


@pytest.mark.slow
def test_two_experiments_do_not_get_in_each_others_way(tmp_path: Path) -> None:
    """Dask warns where its usual port is taken; warnings are errors here."""
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            taken.bind(("", 8787))
            taken.listen()
        except OSError:
            pass  # somebody else has it, which does as well
        with local_workers(1, tmp_path / "first"), local_workers(1, tmp_path / "second"):
            pass
