"""Build hook: FMUs and other libraries are compiled when a wheel or an editable install is made.

It needs what `build-system.requires` names, nothing installed before. A source distribution
carries the C sources instead. FMUs that are up to date are kept.
"""

import os
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from typing_extensions import override


class FmuBuildHook(BuildHookInterface[Any]):
    """Compiles `fmus/<unit>/<unit>.fmu`: for every platform in a wheel, for this one if editable.

    The first build for Windows takes one or two minutes, since Zig compiles its C run-time
    library. `NLOSIM_FMU_TARGETS` (platforms separated by commas, `host` or `all`) chooses.
    """

    PLUGIN_NAME = "custom"

    @override
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        root = Path(self.root)
        sys.path.insert(0, str(root))
        try:
            from fmus.native.build import build_fmu  # noqa: PLC0415
            from fmus.native.libraries import build_libraries  # noqa: PLC0415
            from fmus.native.targets import select_targets  # noqa: PLC0415
            from fmus.native.unit import UNITS, load_unit  # noqa: PLC0415

            usual = "host" if version == "editable" else "all"
            targets = select_targets(os.environ.get("NLOSIM_FMU_TARGETS", usual).split(","))
            for library, seconds in build_libraries(targets):
                self.app.display_info(f"{library.relative_to(root)}: built in {seconds:.1f} s")
            for name in UNITS:
                unit = load_unit(name)
                built = build_fmu(unit, unit.folder, targets=targets)
                state = f"built in {built.seconds:.1f} s" if built.is_new else "up to date"
                self.app.display_info(f"{built.path.relative_to(root)}: {state}")
        finally:
            sys.path.remove(str(root))
