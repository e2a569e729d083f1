"""A headless Chromium for tests, where there is one."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.viewer import chromium
from benchmarks.viewer.chromium import Tab, browser_path

__all__ = ["Tab", "browser", "browser_path"]


@contextmanager
def browser(folder: Path) -> Iterator[Tab]:
    """A page of a new browser, which keeps its files in `folder`; skips the test without one."""
    if browser_path() is None:
        pytest.skip("no browser: none of chromium, google-chrome is on the path")
    with chromium.browser(folder) as tab:
        yield tab
