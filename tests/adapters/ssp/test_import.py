"""What becomes of the connections of a package."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from adapters.ssp.importing import Imported, import_package
from adapters.ssp.times import Wanted
from orchestrator.errors import ScenarioError
from orchestrator.scenario.document import Document
from tests.adapters.ssp.packages import (
    UNITS,
    component,
    connectors,
    description,
    fmu,
    link,
    package,
    system,
    values,
)

LINEAR = '<ssc:LinearTransformation factor="2" offset="0.5"/>'


def imported(folder: Path, content: str, files: Any = None, **options: Any) -> Imported:
    return import_package(package(folder, content, files), folder / "out", **options)


def scenario(found: Imported) -> dict[str, Any]:
    data: dict[str, Any] = Document.read(found.path).data
    return data


def links(folder: Path, content: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = scenario(imported(folder, description(content)))["connections"]
    return found


def problems(folder: Path, content: str, files: Any = None, **options: Any) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        imported(folder, content, files, **options)
    assert not (folder / "out").exists()
    return [str(each) for each in caught.value.problems]


def pair(inside: str = "", more: str = "", *, start: str = "a.y", end: str = "b.u") -> str:
    """Two components and a connection, which stands in the sixth line of the file."""
    return system(
        "top",
        component("a", "y", "z", "u", "v", "m"),
        component("b", "u", "v", "slow", "y", "n"),
        links=link(start, end, inside, more),
    )


def test_a_connection_is_one(tmp_path: Path) -> None:
    found = imported(tmp_path, description(pair()))
    assert scenario(found)["connections"] == [{"from": "a.y", "to": "b.u"}]
    assert scenario(found)["time"] == {"start": "0 s", "stop": "2 s"}
    assert (found.components, found.connections) == (2, 1)
    assert "- {from: a.y, to: b.u}  # SystemStructure.ssd:6:1" in found.path.read_text()
    assert (tmp_path / "out/resources/plant.fmu").is_file()


def test_the_order_of_the_ends_does_not_say_where_values_go(tmp_path: Path) -> None:
    assert links(tmp_path, pair(start="b.u", end="a.y")) == [{"from": "a.y", "to": "b.u"}]


def test_a_linear_transformation_is_gain_and_offset(tmp_path: Path) -> None:
    (found,) = links(tmp_path, pair(LINEAR))
    assert found == {"from": "a.y", "to": "b.u", "gain": 2.0, "offset": 0.5}


def test_units_that_scenarios_convert_need_no_gain(tmp_path: Path) -> None:
    """SSP 2.0, 5.4.2: the transformation follows the conversion, as it does in a scenario."""
    (found,) = links(tmp_path, pair(LINEAR, end="b.slow"))
    assert found == {"from": "a.y", "to": "b.slow", "gain": 2.0, "offset": 0.5}


def test_units_are_not_converted_if_the_connection_says_so(tmp_path: Path) -> None:
    (found,) = links(tmp_path, pair(LINEAR, 'suppressUnitConversion="true"', end="b.slow"))
    assert found == {
        "from": "a.y", "to": "b.slow", "gain": 2.0, "offset": 0.5, "convert": False
    }  # fmt: skip


def test_a_unit_that_only_the_package_knows_is_converted_by_a_gain(tmp_path: Path) -> None:
    """The FMU does not say that `v` is in km/h: 2 m/s are 7.2 km/h."""
    content = system(
        "top",
        component("a", "y"),
        component("b", "v:input:Real km/h"),
        links=link("a.y", "b.v"),
    )
    (found,) = links(tmp_path, content)
    assert found["convert"] is False
    assert found["gain"] == pytest.approx(3.6, rel=1e-15)


def test_text_is_connected(tmp_path: Path) -> None:
    files = {"t.fmu": fmu(said="output String", heard="input String")}
    content = system(
        "top",
        component("a", "said:output:String", source="t.fmu"),
        component("b", "heard:input:String", source="t.fmu"),
        links=link("a.said", "b.heard"),
    )
    found = scenario(imported(tmp_path, description(content), files))
    assert found["connections"] == [{"from": "a.said", "to": "b.heard"}]


def nested(inner: str = "", outer: str = "", port: str = "speed:input") -> str:
    box = system(
        "box", component("b", "u"), ports=connectors(port), links=link(".speed", "b.u", inner)
    )
    around = system("room", box, ports=connectors("given:input"), links=link("box.speed", ".given"))
    return system("top", component("a", "y", "z"), around, links=link("a.y", "room.given", outer))


def test_connections_through_systems_become_one(tmp_path: Path) -> None:
    found = imported(tmp_path, description(nested()))
    assert scenario(found)["connections"] == [{"from": "a.y", "to": "room-box-b.u"}]
    assert list(scenario(found)["components"]) == ["a", "room-box-b"]
    assert "# SystemStructure.ssd:8:1, 11:1, 14:1" in found.path.read_text()


def test_transformations_follow_each_other(tmp_path: Path) -> None:
    """2 (3 y + 1) + 0.5."""
    other = '<ssc:LinearTransformation factor="3" offset="1"/>'
    (found,) = links(tmp_path, nested(LINEAR, other))
    assert (found["gain"], found["offset"]) == (6.0, 2.5)


def test_a_transformation_in_a_unit_of_a_system_has_its_offset_converted(tmp_path: Path) -> None:
    """2 v + 0.5 in mm/s is 2 v + 0.0005 in m/s."""
    content = nested("", "", "speed:input:Real mm/s").replace(
        '<ssd:Connection startElement="box" startConnector="speed" endConnector="given" >',
        '<ssd:Connection startElement="box" startConnector="speed" endConnector="given" >' + LINEAR,
    )
    (found,) = links(tmp_path, content)
    assert (found["gain"], found["offset"]) == (2.0, 0.0005)


def test_names_that_scenarios_cannot_have_are_changed_and_stay_different(tmp_path: Path) -> None:
    content = system("top", component("a b", "y"), component("a.b", "u"), component("-c"),
                     links=link("a b.y", "a.b.u"))  # fmt: skip
    found = scenario(imported(tmp_path, description(content)))
    assert list(found["components"]) == ["a_b", "a_b-2", "c"]
    assert found["connections"] == [{"from": "a_b.y", "to": "a_b-2.u"}]


def test_a_signal_dictionary_connects_what_refers_to_it(tmp_path: Path) -> None:
    dictionary = (
        '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary '
        'version="1.0"><ssb:DictionaryEntry name="speed"><ssc:Real unit="m/s"/>'
        f"</ssb:DictionaryEntry>{UNITS.replace('ssd:', 'ssb:')}</ssb:SignalDictionary>"
        "</ssd:SignalDictionary></ssd:SignalDictionaries>"
    )
    tap = (
        '<ssd:SignalDictionaryReference name="tap" dictionary="bus">'
        f"{connectors('speed:inout')}</ssd:SignalDictionaryReference>"
    )
    box = system("box", tap, component("b", "u"), links=link("tap.speed", "b.u", LINEAR))
    content = system("top", tap, component("a", "y"), box, links=link("a.y", "tap.speed")).replace(
        "</ssd:Connections></ssd:System>\n", f"</ssd:Connections>{dictionary}</ssd:System>\n"
    )
    content = content.replace(
        f"{dictionary}</ssd:System>\n</ssd:Elements>", "</ssd:System>\n</ssd:Elements>"
    )
    assert links(tmp_path, content) == [
        {"from": "a.y", "to": "box-b.u", "gain": 2.0, "offset": 0.5}
    ]


def test_a_signal_dictionary_has_no_parameters(tmp_path: Path) -> None:
    tap = (
        '<ssd:SignalDictionaryReference name="tap" dictionary="bus"><ssd:ParameterBindings>'
        f"{values('x:Real:1')}</ssd:ParameterBindings></ssd:SignalDictionaryReference>"
    )
    found = problems(tmp_path, description(system("top", tap, component("a"))))
    assert any("`tap` is a signal dictionary, which has no parameters" in each for each in found)


def test_annotations_of_other_tools_are_left_out_wherever_they_are(tmp_path: Path) -> None:
    note = '<ssd:Annotations><ssc:Annotation type="com.x"><x/></ssc:Annotation></ssd:Annotations>'
    found = imported(tmp_path, description(pair(note)))
    assert [str(each) for each in found.remarks] == [
        "test.ssp/SystemStructure.ssd:6:103: left out: annotations of `com.x`"
    ]


ENTRY = '<ssc:MapEntry source="1" target="{}"/>'


def test_a_table_that_changes_nothing_is_no_obstacle(tmp_path: Path) -> None:
    table = (
        f"<ssc:IntegerMappingTransformation>{ENTRY.format(1)}</ssc:IntegerMappingTransformation>"
    )
    (found,) = links(tmp_path, pair(table, start="a.m", end="b.n"))
    assert found == {"from": "a.m", "to": "b.n"}


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (pair(end="b.w"), "6:1: the connection of `a.y` and `b.w`: `b` has no connector `w`; "),
        (pair(end="c.u"), "6:1: the connection of `a.y` and `c.u`: there is no element `c`; "),
        (pair(start="a.u"), "6:1: the connection of `a.u` and `b.u`: both ends take values"),
        (pair(end="b.y"), "6:1: the connection of `a.y` and `b.y`: both ends give values"),
        (pair() + "", "nothing"),
        (
            pair(f"<ssc:IntegerMappingTransformation>{ENTRY.format(2)}"
                 "</ssc:IntegerMappingTransformation>", start="a.m", end="b.n"),
            "a scenario has no connection with a table of values (Integer)",
        ),
        (pair("", 'startIndices="1"'), "SSP does not say whether indices count from 0 or from 1"),
        (pair("", 'suppressUnitConversion="no"'), "expected true or false, got `no`"),
        (pair('<ssc:LinearTransformation factor="INF"/>'), "expected a finite number, got `INF`"),
        (
            system("top", component("a", "y"), component("b", "u", "u:input")),
            "`b` has a connector `u` already",
        ),
        (system("top", component("a", "y"), component("a", "u")), "has an element `a` already"),
        (system("top", component("a", "q:input")), "the FMU has no variable `q`; "),
        (
            system("top", component("a", "y:input")),
            "`y` is an `input` here, an `output` of the FMU",
        ),
        (
            system("top", component("a", "y:output:Integer")),
            "`y` is an `Integer` here, a `Real` of the FMU",
        ),
        (
            system("top", component("a", "y:output:Real mm/s")),
            "`y` is in mm/s here, in m/s by the FMU",
        ),
        (system("top", component("a", "y:outputs")), "`kind`: there is no `outputs`"),
        (
            system("top", component("a", source="resources/b.fmu")),
            "there is no `resources/b.fmu` in the package",
        ),
        (
            system("top", component("a", source="../b.fmu")),
            "`../b.fmu` leads out of the package",
        ),
        (
            system("top", component("a").replace(" source", ' type="text/x-modelica" source')),
            "the component `a` is of the type `text/x-modelica`",
        ),
        (
            system("top", component("a").replace(" so", ' implementation="ModelExchange" so')),
            "component `a`: the FMU has no ModelExchange; it has CoSimulation",
        ),
        (
            system("top", component("a", "y").replace("Connector ", 'Connector tpye="x" ')),
            "`ssd:Connector` has no attribute `tpye`",
        ),
        (
            system("top", component("a", inside="<ssd:Wire/>")),
            "`ssd:Component` has no element `ssd:Wire`",
        ),
        (
            system("top", component("a").replace(' name="a"', "")),
            "`ssd:Component`: `name` is missing",
        ),
        (system("top"), "there is no component in the system"),
        (
            system("top", component("a", "y", "n"), component("b", "u"),
                   links=link("a.y", "b.u") + link("b.u", "a.y")),
            "`u` is connected in line 6 already",
        ),
        (
            system("top", component("a", "z:output:Real K"), component("b", "u"),
                   links=link("a.z", "b.u")),
            "units differ: K and m/s",
        ),
        (
            system("top", component("a", "z:output:Real furlong"), component("b", "u"),
                   links=link("a.z", "b.u")),
            "units differ: furlong and m/s, and nothing says what `furlong` is",
        ),
        (
            system("top", component("a", "y"), component("b", "k"), links=link("a.y", "b.k")),
            "`k` is a parameter of its FMU; only inputs are driven",
        ),
    ],
)  # fmt: skip
def test_what_a_scenario_cannot_have_is_told_at_its_place(
    tmp_path: Path, content: str, problem: str
) -> None:
    if problem == "nothing":
        imported(tmp_path, description(content))
        return
    said = problems(tmp_path, description(content))
    assert all(each.startswith("test.ssp/SystemStructure.ssd:") for each in said)
    assert any(problem in each for each in said), said


def test_all_problems_are_told_at_once(tmp_path: Path) -> None:
    content = system(
        "top",
        component("a", "y"),
        component("b", "u"),
        links=link("a.y", "b.w") + link("c.y", "b.u"),
    )
    assert len(problems(tmp_path, description(content))) == 2


def test_connections_in_a_circle_end(tmp_path: Path) -> None:
    box = system("box", ports=connectors("in:input", "out:output"), links=link(".in", ".out"))
    content = system("top", box, component("b", "u"),
                     links=link("box.out", "box.in") + link("box.out", "b.u"))  # fmt: skip
    assert any("in a circle" in each for each in problems(tmp_path, description(content)))


def test_what_is_drawn_is_left_out_and_told_once(tmp_path: Path) -> None:
    geometry = '<ssd:ElementGeometry x1="0" y1="0" x2="1" y2="1"/>'
    note = '<ssc:Annotation type="com.example"><x/></ssc:Annotation>'
    note = f"<ssd:Annotations>{note}</ssd:Annotations>"
    content = system("top", component("a", inside=geometry), component("b", inside=geometry + note))
    found = imported(tmp_path, description(content))
    assert [str(each) for each in found.remarks] == [
        "test.ssp/SystemStructure.ssd:3:54: left out: graphics",
        "test.ssp/SystemStructure.ssd:4:121: left out: annotations of `com.example`",
    ]


def test_outputs_of_the_system_and_inputs_that_nobody_drives_are_told(tmp_path: Path) -> None:
    content = system(
        "top",
        component("a", "y", "u"),
        ports=connectors("out:output", "in:input"),
        links=link("a.y", ".out") + link(".in", "a.u"),
    )
    assert [each.what for each in imported(tmp_path, description(content)).remarks] == [
        "left out: outputs of the system; recorded are those of components",
        "nothing drives `in`: a start value stays",
    ]


def test_a_scenario_that_cannot_run_is_written_and_says_so_at_the_place_in_the_package(
    tmp_path: Path,
) -> None:
    found = imported(tmp_path, description(pair()))
    said = [str(each) for each in found.obstacles]
    assert said[0].startswith(
        "test.ssp/SystemStructure.ssd:3:1: components.a.fmu: resources/plant.fmu"
    )
    assert "it has no binaries" in said[0]
    assert str(tmp_path) not in "".join(said)


def test_numbers_in_a_unit_that_nothing_defines_are_taken_if_asked_for(tmp_path: Path) -> None:
    content = description(
        system("top", component("a", "z:output:Real furlong"), component("b", "u"),
               values=values("b.k:Real:4:[m/s]"), links=link("a.z", "b.u"))
    )  # fmt: skip
    assert len(problems(tmp_path, content)) == 2
    found = imported(tmp_path, content, trusts_numbers=True)
    assert scenario(found)["connections"] == [{"from": "a.z", "to": "b.u", "convert": False}]
    assert scenario(found)["components"]["b"]["parameters"] == {"k": 4.0}
    assert [each.what for each in found.remarks] == [
        f"left out: the unit `{name}`, which nothing defines; numbers are taken as they are"
        for name in ("[m/s]", "furlong")
    ]


def test_the_step_size_of_omsimulator_counts(tmp_path: Path) -> None:
    note = (
        '<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:Annotations '
        'xmlns:oms="https://example.org/oms"><oms:SimulationInformation><oms:FixedStepMaster '
        'stepSize="0.05"/></oms:SimulationInformation></oms:Annotations></ssc:Annotation>'
        "</ssd:Annotations></ssd:System>"
    )
    content = description(pair().replace("</ssd:System>", note))
    assert scenario(imported(tmp_path, content))["components"]["a"]["step"] == "50 ms"


def test_without_a_step_size_there_are_500_steps(tmp_path: Path) -> None:
    assert scenario(imported(tmp_path, description(pair())))["components"]["a"]["step"] == "4 ms"


def test_step_and_stop_of_the_command_line_count(tmp_path: Path) -> None:
    wanted = Wanted(stop=Fraction(3), step=Fraction(1, 60))
    found = scenario(imported(tmp_path, description(pair()), wanted=wanted))
    assert found["time"]["stop"] == "3 s"
    assert {each["step"] for each in found["components"].values()} == {"1/60 s"}


@pytest.mark.parametrize(
    ("step", "problem"),
    [("0", "a step size of 0.0 s"), ("1e-10", "a step size of 1e-10 s, no whole number of nano")],
)
def test_a_step_that_cannot_be_is_told(tmp_path: Path, step: str, problem: str) -> None:
    (found,) = problems(tmp_path, description(pair()), wanted=Wanted(step=Fraction(step)))
    assert problem in found


@pytest.mark.parametrize(
    ("experiments", "expected"),
    [
        ([], "4 ms"),
        (["0.25"], "250 ms"),
        (["0.5", "0.02"], "20 ms"),
        (["0.3"], "4 ms"),
        (["0.016666666666666666"], "1/60 s"),
        ([None, "0.1"], "100 ms"),
    ],
)
def test_the_shortest_step_of_the_fmus_counts_if_it_divides_the_time(
    tmp_path: Path, experiments: list[str | None], expected: str
) -> None:
    """From 0 to 2 s."""
    text = "".join(component(f"c{k}", source=f"f{k}.fmu") for k in range(len(experiments)))
    files = {
        f"f{k}.fmu": fmu(y="output Real", experiment="" if step is None else f'stepSize="{step}"')
        for k, step in enumerate(experiments)
    }
    content = description(system("top", text or component("a")))
    found = scenario(imported(tmp_path, content, files))["components"].values()
    assert {each["step"] for each in found} == {expected}


def test_without_times_it_is_the_latest_stop_of_the_fmus_or_a_second(tmp_path: Path) -> None:
    content = description(
        system("top", component("a", source="a.fmu"), component("b", source="b.fmu"))
    )
    content = content.replace(' stopTime="2"', "").replace('startTime="0"', 'startTime="0.5"')
    files = {
        "a.fmu": fmu(y="output Real", experiment='stopTime="7"'),
        "b.fmu": fmu(y="output Real", experiment='stopTime="3"'),
    }
    (tmp_path / "1").mkdir()
    assert scenario(imported(tmp_path / "1", content, files))["time"] == {
        "start": "500 ms", "stop": "7 s"
    }  # fmt: skip
    silent = {name: fmu(y="output Real") for name in files}
    (tmp_path / "2").mkdir()
    assert scenario(imported(tmp_path / "2", content, silent))["time"]["stop"] == "1500 ms"
