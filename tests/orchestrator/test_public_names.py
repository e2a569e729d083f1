"""The public names: what type checkers see is what is there, and importing it is light."""

import ast
import subprocess
import sys
from pathlib import Path

import orchestrator


def test_type_checkers_and_users_see_the_same_names() -> None:
    tree = ast.parse(Path(orchestrator.__file__).read_text())
    (guarded,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.name: node.module
        for node in guarded.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(seen) == orchestrator.__all__
    for name, module in seen.items():
        assert getattr(orchestrator, name) is getattr(sys.modules[str(module)], name)


def test_the_command_line_starts_without_numpy() -> None:
    code = "import sys, orchestrator.cli.execution; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
