"""Component types are found by name; every miss is answered with what to do."""

from pathlib import Path

import pytest

from orchestrator import registry
from orchestrator.errors import ComponentTypeError
from orchestrator.registry import component_type, fmu_type, installed

MODULE = '''
"""Units for this test."""

from orchestrator import Component, ComponentType


class Trace(Component):
    """Replays a trace."""

    connectors = {}

    def setup(self, start, rng): ...
    def step(self, inputs, t, h): ...
    def outputs(self):
        return {}


class Kind(ComponentType):
    def __init__(self, path="none"):
        self.path = path

    @property
    def description(self):
        return f"opened {self.path}"

    @property
    def parameters(self):
        return {}

    def create(self, name, values):
        return Trace()


KIND = Kind("at import")


def open_fmu(path):
    if path.read_text() != "fmu":
        raise ValueError("not a zip file")
    return Kind(path.name)
'''

ENTRY_POINTS = """
[orchestrator.components]
trace = nlosim_test_units:Trace
kind = nlosim_test_units:Kind
kind-object = nlosim_test_units:KIND
not-a-type = nlosim_test_units:open_fmu
misspelt = nlosim_test_units:Tracee
broken = nlosim_test_broken:Anything

[orchestrator.fmus]
radio = nlosim_test_fmus
unbuilt = nlosim_test_fmus
lost = nlosim_test_lost

[orchestrator.importers]
fmu = nlosim_test_units:open_fmu
"""


def install(folder: Path, name: str, entry_points: str) -> None:
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entry_points)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path with a distribution that offers component types."""
    (tmp_path / "nlosim_test_units.py").write_text(MODULE)
    (tmp_path / "nlosim_test_broken.py").write_text("import nlosim_test_missing_library\n")
    fmus = tmp_path / "nlosim_test_fmus"
    fmus.mkdir()
    (fmus / "__init__.py").write_text("")
    (fmus / "radio.fmu").write_text("fmu")
    install(tmp_path, "nlosim_test_dist", ENTRY_POINTS)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("site")
def test_classes_objects_and_fmus_become_component_types() -> None:
    found = {name: component_type(name).description for name in ("trace", "kind", "kind-object")}
    assert found == {
        "trace": "Replays a trace.",
        "kind": "opened none",
        "kind-object": "opened at import",
    }
    assert component_type("radio").description == "opened radio.fmu"
    assert type(component_type("trace").create("t", {})).__name__ == "Trace"


@pytest.mark.usefixtures("site")
def test_offers_are_listed_without_importing_them() -> None:
    offers = installed()
    assert list(offers) == sorted(offers)
    assert offers["broken"].origin == "nlosim_test_broken:Anything"
    assert {"trace", "kind", "radio", "unbuilt", "lost"} <= offers.keys()


@pytest.mark.usefixtures("site")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("tracce", "no component type `tracce` is installed; did you mean `trace`?"),
        ("a/ball.fmu", "in a scenario write `fmu: a/ball.fmu` in place of `type`"),
        ("fmu", "for an FMU write its file, `model.fmu`, for a class of yours `module:Class`"),
        (
            "broken",
            (
                "cannot load `broken` from `nlosim_test_broken:Anything`: ModuleNotFoundError: No "
                "module named 'nlosim_test_missing_library'"
            ),
        ),
        ("misspelt", "cannot load `misspelt` from `nlosim_test_units:Tracee`: AttributeError"),
        ("not-a-type", "`nlosim_test_units:open_fmu` is neither a subclass of `Component` nor"),
        (
            "unbuilt",
            (
                "`nlosim_test_fmus` is installed without `unbuilt.fmu`; build it with "
                "`nlosim fmu build`"
            ),
        ),
        ("lost", "cannot load `lost` from `nlosim_test_lost`: ModuleNotFoundError"),
    ],
)
def test_what_cannot_be_loaded_says_why(name: str, message: str) -> None:
    with pytest.raises(ComponentTypeError) as error:
        component_type(name)
    assert message in str(error.value)


@pytest.mark.usefixtures("site")
def test_who_misspelt_a_name_is_told_that_name_alone() -> None:
    with pytest.raises(ComponentTypeError) as error:
        component_type("tracce")
    assert str(error.value).endswith("did you mean `trace`?")


def test_two_packages_with_one_name_are_a_conflict(site: Path) -> None:
    offer = "[orchestrator.components]\ntrace = other_package:Trace\n"
    install(site, "nlosim_test_rival", offer)
    with pytest.raises(ComponentTypeError) as error:
        component_type("trace")
    assert str(error.value) == (
        "component type `trace` is offered several times: nlosim_test_units:Trace, "
        "other_package:Trace; uninstall all but one of these packages"
    )


def test_an_fmu_is_opened_by_the_importer(site: Path) -> None:
    good, bad = site / "good.fmu", site / "bad.fmu"
    good.write_text("fmu")
    bad.write_text("text")
    assert fmu_type(good).description == "opened good.fmu"
    with pytest.raises(ComponentTypeError, match=r"cannot open `.*bad.fmu`: ValueError: not a zip"):
        fmu_type(bad)
    with pytest.raises(ComponentTypeError, match=r"there is no file `.*no.fmu`"):
        fmu_type(site / "no.fmu")


def test_without_an_importer_the_error_says_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu = tmp_path / "any.fmu"
    fmu.write_text("fmu")
    monkeypatch.setattr(registry, "entry_points", lambda group: ())
    with pytest.raises(ComponentTypeError, match=r"`trace` is installed; no installed package off"):
        component_type("trace")
    with pytest.raises(ComponentTypeError, match=r"no package offers `fmu` in .*importers`"):
        fmu_type(fmu)
