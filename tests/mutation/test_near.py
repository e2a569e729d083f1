"""Which test files are near a source is said by their names and imports."""

from pathlib import Path

import pytest

from tests.mutation.near import Near

SOURCES = {
    "adapters/fmi/__init__.py": "from adapters.fmi.types import Kind",
    "adapters/fmi/types.py": "from adapters.fmi import options",
    "adapters/fmi/options.py": "import json",
    "orchestrator/plan/unit.py": "",
    "orchestrator/plan/plan.py": "import orchestrator.plan.unit",
    "tests/adapters/test_far.py": "import adapters.fmi",
    "tests/adapters/test_direct.py": "from adapters.fmi.options import a",
    "tests/adapters/test_fmi_options.py": "from adapters.fmi import Kind",
    "tests/adapters/helpers.py": "from adapters.fmi.options import b",
    "tests/adapters/test_helped.py": "def f():\n    from tests.adapters import helpers",
    "adapters/tables/sink.py": "",
    "tests/adapters/test_skipped.py": "a = pytest.importorskip('adapters.tables.sink')",
    "tests/adapters/test_loaded.py": "a = importlib.import_module('adapters.tables.sink', None)",
    "tests/adapters/test_other.py": "import orchestrator.plan.plan",
    "tests/fmus/lidar/test_scan.py": "",
    "tests/fmus/native/test_shell.py": "",
}


@pytest.fixture
def near(tmp_path: Path) -> Near:
    for name, text in SOURCES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return Near.read(tmp_path)


def test_who_imports_it_with_fewer_in_between_comes_first(near: Near) -> None:
    """The one that has its name needs three imports, which count as one."""
    found = ["test_direct", "test_fmi_options", "test_helped", "test_far"]
    assert near.to("adapters/fmi/options.py", 9) == [f"tests/adapters/{x}.py" for x in found]
    assert near.to("adapters/fmi/options.py", 2) == [f"tests/adapters/{x}.py" for x in found[:2]]


def test_what_is_imported_where_it_is_there_is_imported(near: Near) -> None:
    found = [f"tests/adapters/test_{how}.py" for how in ("loaded", "skipped")]
    assert near.to("adapters/tables/sink.py", 9) == found


def test_a_file_that_nobody_imports_has_no_test_near_it(near: Near) -> None:
    assert near.to("adapters/unknown.py", 9) == []


def test_tests_of_a_unit_are_near_its_c_and_those_of_its_caller_near_the_engine(near: Near) -> None:
    assert near.to("fmus/lidar/pattern.c", 9) == ["tests/fmus/lidar/test_scan.py"]
    shell = ["tests/fmus/native/test_shell.py", "tests/fmus/lidar/test_scan.py"]
    assert near.to("fmus/native/shell.c", 9) == shell
    assert near.to("orchestrator/plan/engine.c", 9) == ["tests/adapters/test_other.py"]
