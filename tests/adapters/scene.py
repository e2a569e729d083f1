"""Small SUMO scenes, each made by a test in a folder of its own."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import scenarios
from adapters.sumo.checking import SceneCheck, check_scene
from orchestrator.errors import Problem

ASSETS = Path(scenarios.__file__).parent / "assets" / "red_light"
NET = "red_light.net.xml"
ROUTES = "demand.rou.xml"
SHAPES = "shapes.add.xml"


@dataclass(frozen=True)
class Folder:
    """A scene with the net of the red-light study; a test adds what it is about."""

    path: Path

    @classmethod
    def with_net(cls, path: Path) -> "Folder":
        """A folder that holds the net."""
        shutil.copy(ASSETS / NET, path)
        return cls(path)

    def write(self, name: str, text: str) -> Path:
        file = self.path / name
        file.write_text(text)
        return file

    def config(
        self, *, net: str = NET, routes: str = "", additional: str = "", more: str = ""
    ) -> Path:
        """A configuration, one option per line."""
        inputs = {"net-file": net, "route-files": routes, "additional-files": additional}
        options = [f'<{name} value="{value}"/>' for name, value in inputs.items() if value]
        lines = ["<configuration>", "<input>", *options, "</input>", more, "</configuration>"]
        return self.write("scene.sumocfg", "\n".join(line for line in lines if line))

    def routes(self, *lines: str, thorough: bool = False) -> SceneCheck:
        """Check a scene with these lines in its route file, the first of which is line 2."""
        self.write(ROUTES, "\n".join(["<routes>", *lines, "</routes>"]))
        return check_scene(self.config(routes=ROUTES), thorough=thorough)

    def additional(self, *lines: str, thorough: bool = False) -> SceneCheck:
        """Check a scene with these lines in an additional file, the first of which is line 2."""
        self.write(SHAPES, "\n".join(["<additional>", *lines, "</additional>"]))
        return check_scene(self.config(additional=SHAPES), thorough=thorough)


def said(problems: Sequence[Problem]) -> list[str]:
    """Problems with the names of files instead of their paths."""
    return [
        f"{Path(p.where.file).name}:{p.where.line}:{p.where.column}: {p.what}" for p in problems
    ]
