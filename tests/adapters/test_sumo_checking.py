"""What is found in the files of a SUMO scene, each thing at its line and column."""

import gzip
import re
import shutil
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from adapters.sumo.checking import check_scene
from adapters.sumo.checks.findings import MOST
from adapters.sumo.component import SumoTraffic
from adapters.sumo.parameters import TrafficParameters
from tests.adapters.scene import ASSETS, NET, ROUTES, SHAPES, Folder, said

SCENE = ASSETS / "red_light.sumocfg"
CAR = '<vehicle id="{}" depart="0" type="{}"><route edges="south_in north_out"/></vehicle>'
BUILDING = '<poly id="{}" type="{}" shape="{}"><param key="height" value="{}"/></poly>'
SQUARE = "0,0 10,0 10,10 0,10"
FAR_LINE = "3500000.1,5500000.3 3500005.3,5500003.7 3500020.9,5500013.9"
"""Points of a line at Gauss-Kruger coordinates, whose products are rounded to some 0.004 m2."""


@pytest.mark.parametrize("thorough", [False, True], ids=["static", "thorough"])
def test_the_red_light_scene_has_no_problem_and_no_vehicle(*, thorough: bool) -> None:
    check = check_scene(SCENE, thorough=thorough)
    assert check.problems == ()
    assert check.remarks == ()
    assert check.is_empty


@pytest.mark.parametrize("more", ["", '<begin value="57600"/>'], ids=["from 0 s", "from 16 h"])
def test_a_sound_scene_passes(more: str, folder: Folder) -> None:
    folder.write(ROUTES, f"<routes>{CAR.format('a', 'DEFAULT_VEHTYPE')}</routes>")
    check = check_scene(folder.config(routes=ROUTES, more=more), thorough=True)
    assert (check.problems, check.remarks) == ((), ())


def test_a_net_far_from_the_origin_is_said(folder: Folder) -> None:
    net = folder.path / NET
    text = net.read_text()
    net.write_text(text.replace('convBoundary="-220.00', 'convBoundary="3000000', 1))
    check = check_scene(folder.config(), thorough=False)
    line = next(k for k, each in enumerate(text.splitlines(), 1) if "<location" in each)
    assert check.problems == ()
    (remark,) = said(check.remarks)
    assert remark.startswith(f"{NET}:{line}:5: the coordinate 3000000 m is far from the origin: ")
    assert remark.endswith("relative to the corner of the net, or to the parameter `origin`")


def lift(net: Path, lanes: str) -> None:
    """Put lanes 8.25 m above the ground; `lanes` is a pattern of their names."""

    def lifted(lane: re.Match[str]) -> str:
        return f'{lane[1]}shape="{" ".join(f"{point},8.25" for point in lane[2].split())}"'

    net.write_text(re.sub(rf'(<lane id="{lanes}" .*)shape="([^"]*)"', lifted, net.read_text()))


def test_heights_of_the_net_are_said_at_the_first_lane_that_has_one(folder: Folder) -> None:
    """Who says none is at 0 m: netconvert leaves those out."""
    net = folder.path / NET
    lift(net, "south_in_[12]")
    lines = net.read_text().splitlines()
    line = next(k for k, each in enumerate(lines, 1) if '"south_in_1"' in each)
    (remark,) = said(check_scene(folder.config(), thorough=False).remarks)
    assert remark == (
        f"{NET}:{line}:9: the net says heights from 0 m to 8.25 m: the ground is taken as flat, "
        "so that roads above each other meet"
    )


def test_one_high_point_of_a_lane_is_a_height(folder: Folder) -> None:
    """netconvert writes none of points at 0 m."""
    net = folder.path / NET
    lane = re.compile(r'(<lane id="south_in_1" [^>]*shape="[^ "]*)')
    net.write_text(lane.sub(r"\1,5.5", net.read_text(), count=1))
    (remark,) = said(check_scene(folder.config(), thorough=False).remarks)
    assert "the net says heights from 0 m to 5.5 m" in remark


def test_a_net_that_is_high_everywhere_is_as_one_that_is_nowhere(folder: Folder) -> None:
    assert check_scene(folder.config(), thorough=False).remarks == ()
    lift(folder.path / NET, '[^"]*')
    assert check_scene(folder.config(), thorough=False).remarks == ()


@pytest.mark.parametrize(("traci", "count"), [("", 1), ("localhost:8813", 0)])
def test_sumo_refuses_a_lane_of_one_point(folder: Folder, traci: str, count: int) -> None:
    """So a lane always has a direction. A SUMO that `traci` joins has opened the scene already."""
    net = folder.path / NET
    lane = re.compile(r'(<lane id="south_in_1" [^>]*shape="[^ "]*) [^"]*"')
    net.write_text(lane.sub(r'\1"', net.read_text(), count=1))
    parameters = TrafficParameters(scene=folder.config(), traci=traci)
    found = [each.what for each in SumoTraffic.check_files(parameters, thorough=True).problems]
    assert sum("Shape of lane 'south_in_1' is broken" in each for each in found) == count, found


def test_outputs_are_those_of_the_sumo_that_runs_here(folder: Folder) -> None:
    """The one that `traci` joins has its own."""
    config = folder.config(more='<fcd-output value="away/fcd.xml"/>')
    here, there = (TrafficParameters(scene=config, traci=at) for at in ("", "localhost:8813"))
    (problem,) = SumoTraffic.check_files(here, thorough=False).problems
    assert f"the folder {folder.path / 'away'} does not exist" in problem.what
    assert SumoTraffic.check_files(there, thorough=False).problems == ()


def test_a_left_hand_net_passes(folder: Folder) -> None:
    net = folder.path / NET
    net.write_text(net.read_text().replace("<net ", '<net lefthand="true" ', 1))
    assert check_scene(folder.config(), thorough=True).problems == ()


def test_compressed_files_are_read(folder: Folder) -> None:
    with gzip.open(folder.path / "net.xml.gz", "wb") as stream:
        stream.write((ASSETS / NET).read_bytes())
    assert check_scene(folder.config(net="net.xml.gz"), thorough=True).problems == ()
    whole = (folder.path / "net.xml.gz").read_bytes()
    (folder.path / "net.xml.gz").write_bytes(whole[: len(whole) // 2])
    (problem,) = check_scene(folder.config(net="net.xml.gz"), thorough=False).problems
    assert "net.xml.gz:1:1: the compressed file is damaged" in str(problem)


def test_a_cut_net_is_said_once_where_it_ends(folder: Folder) -> None:
    text = (ASSETS / NET).read_text()
    cut = text[: text.index('<edge id=":center_9"')]
    folder.write(NET, cut + "<edge id=")
    check = folder.routes(CAR.format("a", "DEFAULT_VEHTYPE"), thorough=True)
    line = cut.count("\n") + 1
    assert said(check.problems) == [
        f"{NET}:{line}:5: not XML: unclosed token; the file is empty or has been cut off"
    ]


@pytest.mark.parametrize(
    ("net", "expected"),
    [
        ("<routes/>", "1:1: this is no net: it begins with `<routes>`, which is a route file"),
        ("<nodes/>", "1:1: this is no net: it begins with `<nodes>`, which is a source of a net"),
        ("<osm/>", "1:1: this is no net: it begins with `<osm>`, which is something else"),
        ('<net version="1.20"/>', "1:1: the net has no lanes"),
        (
            '<net version="1.20"><edge id="e"><lane id="e_0"/></edge>\n <edge id="e"/></net>',
            "2:2: edge `e` is declared in line 1 already",
        ),
        (
            (
                '<net version="1.20"><edge id="e" from="j" to="k"><lane id="e_0"/></edge>'
                '<junction id="j"/></net>'
            ),
            "1:21: edge `e`: `to` is junction `k`, which is not here",
        ),
        (
            (
                '<net version="1.20"><edge id="e"><lane id="e_0"/></edge>\n'
                '<connection from="e" to="f"/></net>'
            ),
            "2:1: connection: `to` is edge `f`, which is not before it",
        ),
    ],
)
def test_a_wrong_net_is_said(net: str, expected: str, folder: Folder) -> None:
    folder.write(NET, net)
    (problem,) = check_scene(folder.config(), thorough=False).problems
    assert said([problem])[0].startswith(f"{NET}:{expected}")


@pytest.mark.parametrize(
    ("name", "is_routes"), [(NET, True), (NET, False), ("scene.sumocfg", False)]
)
def test_a_file_of_another_kind_is_said(name: str, *, is_routes: bool, folder: Folder) -> None:
    config = folder.config(routes=name) if is_routes else folder.config(additional=name)
    (problem,) = check_scene(config, thorough=True).problems
    wanted = "route file" if is_routes else "additional file"
    assert f"this is no {wanted}: it begins with `<" in problem.what


def test_whatever_names_an_edge_names_one_of_the_net(folder: Folder) -> None:
    check = folder.routes(
        '<route id="r" edges="south_in x y"/>',
        '<vehicle id="a" depart="0"><route edges="z"/></vehicle>',
        '<trip id="b" depart="0" from="x" to="north_out" via="south_in"/>',
        '<flow id="c" begin="0" end="1" number="1" from="south_in" to="north_out" via="x"/>',
        '<person id="d" depart="0"><walk edges="x"/><ride to="y"/></person>',
        '<vehicle id="e" depart="0" route="s"><stop lane="south_in_7"/></vehicle>',
    )
    assert said(check.problems) == [
        f"{ROUTES}:2:1: route `r`: `edges`: the net has no edge `x` (and 1 more here)",
        f"{ROUTES}:3:28: route: `edges`: the net has no edge `z`",
        f"{ROUTES}:4:1: trip `b`: `from`: the net has no edge `x`",
        f"{ROUTES}:5:1: flow `c`: `via`: the net has no edge `x`",
        f"{ROUTES}:6:27: walk: `edges`: the net has no edge `x`",
        f"{ROUTES}:6:44: ride: `to`: the net has no edge `y`",
        f"{ROUTES}:7:1: vehicle `e`: no file of the scene declares the route `s`",
        f"{ROUTES}:7:38: stop: `lane`: the net has no lane `south_in_7`",
    ]


def test_types_are_declared_anywhere_in_the_scene_or_built_in(folder: Folder) -> None:
    check = folder.routes(
        CAR.format("a", "late"),
        '<vType id="late"/>',
        CAR.format("b", "DEFAULT_BIKETYPE"),
        '<vTypeDistribution id="mix" vTypes="late none"/>',
        CAR.format("c", "mix"),
        CAR.format("d", "taxi"),
    )
    assert [what.partition("; add")[0] for what in said(check.problems)] == [
        f"{ROUTES}:5:1: vTypeDistribution `mix`: no file of the scene declares the type `none`",
        f"{ROUTES}:7:1: vehicle `d`: no file of the scene declares the type `taxi`",
    ]


def test_ids_are_unique_among_their_kind(folder: Folder) -> None:
    check = folder.routes(
        CAR.format("a", "DEFAULT_VEHTYPE"),
        '<trip id="a" depart="0" from="south_in" to="north_out"/>',
        '<flow id="a" begin="0" end="1" number="1" from="south_in" to="north_out"/>',
        '<vType id="a"/>',
        '<vTypeDistribution id="a"/>',
    )
    assert said(check.problems) == [
        f"{ROUTES}:3:1: trip `a` is declared in line 2 already",
        f"{ROUTES}:6:1: vTypeDistribution `a` is declared in line 5 already",
    ]


@pytest.mark.parametrize("shape", ["0,0 5,5 x", "0,0 5,nan 1,9"])
def test_the_shape_of_a_building_is_a_list_of_points(shape: str, folder: Folder) -> None:
    check = folder.additional(" " + BUILDING.format("bad", "building", shape, 5))
    (problem,) = said(check.problems)
    assert problem == (f"{SHAPES}:2:2: building `bad`: `shape` is a list of `x,y`, got `{shape}`")


@pytest.mark.parametrize(
    ("kind", "shape", "height", "expected"),
    [
        ("building", "0,0 1,0", "5", "is left out: at least 3 different corners are needed, there"),
        ("building", "0,0 1,0 0,0.001 1,0", "5", "is left out: at least 3 different corners are"),
        ("building.yes", "0,0 5,5 9,9", "5", "is left out: its corners lie on a line, or its"),
        ("building", FAR_LINE, "5", "is left out: its corners lie on a line, or its outline"),
        ("building", "", "5", "is left out: at least 3 different corners are needed, there are 0"),
        ("building", SQUARE, "tall", "gets the default height: a height [m] is a positive number"),
        ("building", SQUARE, "0", "gets the default height: a height [m] is a positive"),
        ("building.house", SQUARE, "-3", "gets the default height: a height [m] is a positive"),
        (
            "building",
            SQUARE,
            "inf",
            "gets the default height: a height [m] is a positive",
        ),
    ],
)
def test_what_a_building_lacks_is_said(
    kind: str, shape: str, height: str, expected: str, folder: Folder
) -> None:
    check = folder.additional(
        BUILDING.format("good", kind, SQUARE, 3), " " + BUILDING.format("bad", kind, shape, height)
    )
    assert check.problems == ()
    (remark,) = said(check.remarks)
    assert remark.startswith(f"{SHAPES}:3:2: building `bad` {expected}")


@pytest.mark.parametrize(
    ("attribute", "inside", "hint"),
    [
        ("", "", ""),
        ("", '<param key="floors" value="3"/>', ""),
        ('height="12"', "", "; building `b` has the attribute `height`, which counts for nothing:"),
        ("", '<param key="Height" value="2"/>', "; building `b` has the parameter `Height`, which"),
        ("", '<param key="building:height" value="2"/>', "; building `b` has the parameter `build"),
    ],
)
def test_buildings_without_a_height_are_counted_once(
    attribute: str, inside: str, hint: str, folder: Folder
) -> None:
    """Those that are left out, and those whose height is wrong, have remarks of their own."""
    building = f'<poly id="{{}}" type="building" shape="{SQUARE}" {{}}>{{}}</poly>'
    sound = BUILDING.format("c", "building", SQUARE, 3)
    flat = '<poly id="d" type="building" shape="0,0 1,0"/>'
    alone = folder.additional(sound, building.format("b", attribute, inside))
    assert alone.problems == ()
    (remark,) = said(alone.remarks)
    what = "1 of 2 buildings says no height and is taken as 10 m high"
    assert remark.startswith(f"{SHAPES}:3:1: {what}{hint}")
    assert remark.endswith(
        'write `<param key="height" value="..."/>` into its element' * bool(hint)
    )
    check = folder.additional(
        flat, building.format("a", "", ""), sound, building.format("b", attribute, inside)
    )
    left_out, remark = said(check.remarks)
    assert "`d` is left out" in left_out
    what = "2 of 3 buildings say no height and are taken as 10 m high"
    assert remark.startswith(f"{SHAPES}:3:1: {what}{hint}")


def test_the_height_of_buildings_that_say_none_is_that_of_the_parameter(folder: Folder) -> None:
    folder.write(
        SHAPES, f'<additional><poly id="b" type="building" shape="{SQUARE}"/></additional>'
    )
    scene = folder.config(additional=SHAPES)
    parameters = TrafficParameters(scene=scene, building_height=7.5)
    found = SumoTraffic.check_files(parameters, thorough=False)
    assert any("is taken as 7.5 m high" in each.what for each in found.remarks)


def test_a_building_in_degrees_needs_a_net_with_a_projection(folder: Folder) -> None:
    shape = "11.5,48.1 11.6,48.1 11.6,48.2"
    lines = [
        f'<poly id="{name}" type="{kind}" geo="true" shape="{shape}">'
        '<param key="height" value="9"/></poly>'
        for name, kind in (("a", "building"), ("park", "leisure"))
    ]
    (problem,) = said(folder.additional(*lines).problems)
    assert problem == (
        f"{SHAPES}:2:1: building `a`: `geo` says degrees, which would be taken as metres: the net "
        "has no projection; write metres, or make the net with one"
    )
    net = folder.path / NET
    proj = 'projParameter="+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"'
    net.write_text(net.read_text().replace('projParameter="!"', proj))
    assert folder.additional(*lines).problems == ()


def test_polygons_that_are_no_buildings_are_counted(folder: Folder) -> None:
    lines = [f'<poly id="{k}" type="landuse.forest" shape="0,0"/>' for k in range(12)]
    check = folder.additional(*lines, '<poly id="w" type="buildings" shape=""/>')
    assert check.problems == ()
    assert said(check.remarks)[:2] == [
        f"{SHAPES}:2:1: 12 polygons of type `landuse.forest` are no buildings",
        f"{SHAPES}:14:1: 1 polygon of type `buildings` is no building",
    ]


def test_unknown_edges_are_remarks_where_sumo_is_to_ignore_them(folder: Folder) -> None:
    folder.write(ROUTES, '<routes><trip id="a" depart="0" from="x" to="north_out"/></routes>')
    for more, is_ignored in (("", False), ('<ignore-route-errors value="true"/>', True)):
        check = check_scene(folder.config(routes=ROUTES, more=more), thorough=False)
        found, others = check.problems, check.remarks
        if is_ignored:
            found, others = others, found
        (what,) = said(found)
        assert "`x`" in what
        assert others == ()


def test_loads_are_left_out_and_said(folder: Folder) -> None:
    load = '<container id="{}" depart="0"><tranship from="south_in" to="north_out"/></container>'
    check = folder.routes(load.format("a"), load.format("b"))
    assert check.problems == ()
    assert said(check.remarks) == [
        f"{ROUTES}:2:1: 2 containers or flows of them are left out: loads are no road users"
    ]


def test_of_very_many_problems_the_rest_is_counted(folder: Folder) -> None:
    check = folder.routes(
        *(f'<trip id="{k}" depart="0" from="x" to="north_out"/>' for k in range(MOST + 1480))
    )
    assert len(check.problems) == MOST + 1
    assert said(check.problems)[-1] == (
        f"{ROUTES}:{MOST + 2}:1: ... and 1,480 more unknown edges from here on"
    )


def test_entities_are_refused_before_they_grow(folder: Folder) -> None:
    laughs = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(9))
    bomb = f'<!DOCTYPE r [<!ENTITY a0 "ha">{laughs}]>\n<routes>&a9;</routes>'
    folder.write(ROUTES, bomb)
    (problem,) = check_scene(folder.config(routes=ROUTES), thorough=True).problems
    assert "a document type (`<!DOCTYPE ...>`) is refused" in problem.what
    assert problem.where.line == 1


FILES = ("red_light.sumocfg", "red_light.net.xml", "red_light.typ.xml", "red_light.poly.xml")


@given(data=st.data())
def test_no_cut_file_raises(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("cut")
    for file in ASSETS.glob("red_light.*"):
        shutil.copy(file, folder)
    victim = folder / data.draw(st.sampled_from(FILES))
    whole = victim.read_bytes()
    end = len(whole.rstrip())
    victim.write_bytes(whole[: data.draw(st.integers(0, end - 1))])
    found = check_scene(folder / "red_light.sumocfg", thorough=False).problems
    assert [problem.where.file for problem in found] == [str(victim)]


@given(data=st.data())
def test_no_damaged_file_raises(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    for file in ASSETS.glob("red_light.*"):
        shutil.copy(file, folder)
    victim = folder / data.draw(st.sampled_from(FILES))
    raw = bytearray(victim.read_bytes())
    for place in data.draw(st.lists(st.integers(0, len(raw) - 1), min_size=1, max_size=5)):
        raw[place] = data.draw(st.integers(0, 255))
    victim.write_bytes(raw)
    for problem in check_scene(folder / "red_light.sumocfg", thorough=False).problems:
        assert Path(problem.where.file).parent == folder


UNSORTED = """\
<routes>
<vehicle id="a" depart="10"><route edges="south_in north_out"/></vehicle>
<vehicle id="b" depart="5"><route edges="south_in north_out"/></vehicle>
<person id="p" depart="triggered"><walk edges="south_in"/></person>
<trip id="t" depart="0:00:12" from="south_in" to="north_out"/>
<flow id="f" begin="11" end="20" period="3" from="south_in" to="north_out"/>
<personFlow id="g" begin="12" end="20" period="3"><walk edges="south_in"/></personFlow>
</routes>
"""


def test_who_stands_behind_one_that_departs_later_is_left_out_and_said(folder: Folder) -> None:
    """As SUMO does: it ignores `b` and `f`, and says so only once it has read that far."""
    folder.write(ROUTES, UNSORTED)
    check = check_scene(folder.config(routes=ROUTES), thorough=False)
    late = "{} is left out by SUMO: it departs at {} s, and stands behind one that departs at {} s"
    assert check.problems == ()
    assert said(check.remarks) == [
        f"{ROUTES}:3:1: {late.format('vehicle `b`', 5, 10)}; sort the file by departure",
        f"{ROUTES}:6:1: {late.format('flow `f`', 11, 12)}; sort the file by departure",
    ]


@pytest.mark.parametrize("how", ["all at once", "in an additional file"])
def test_where_sumo_reads_all_demand_first_the_order_does_not_matter(
    how: str, folder: Folder
) -> None:
    if how == "all at once":
        folder.write(ROUTES, UNSORTED)
        config = folder.config(routes=ROUTES, more='<route-steps value="0"/>')
    else:
        folder.write(SHAPES, UNSORTED.replace("routes>", "additional>"))
        config = folder.config(additional=SHAPES)
    check = check_scene(config, thorough=False)
    assert (check.problems, check.remarks) == ((), ())
