"""The log of a run, and what of it is shown."""

import logging
from pathlib import Path

import pytest

from orchestrator.log import LOG, run_log


def test_warnings_of_libraries_about_themselves_are_in_the_file_alone(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with run_log(tmp_path, echo=True):
        logging.getLogger("matplotlib.font_manager").warning("made a cache")
        logging.getLogger("my_package.parts").warning("an odd value")
    assert capfd.readouterr().err == "warning: an odd value\n"
    log = (tmp_path / LOG).read_text()
    assert "made a cache" in log
    assert "an odd value" in log
