"""Formats of traffic files: equal contents give equal runs, and nothing wrong stays unsaid."""

import gzip
import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from adapters.replay.kinds import CLASSES, DEFAULT_TYPES
from adapters.replay.snapshot import file_time
from adapters.traffic.bodies import Body
from orchestrator.cli import main
from orchestrator.errors import ComponentTypeError
from tests.adapters.traces import (
    Sample,
    array,
    entered,
    replay,
    states,
    write_csv,
    write_fcd,
    write_parquet,
)

SCENARIO = """
schema: 1
title: Replay
time: {start: 0 s, stop: 2 s}
coupling: {algorithm: jacobi}
components:
  traffic:
    type: fcd-replay
    step: 50 ms
    process: on-request
    parameters: {file: FILE, heading: compass-deg, reference: front, radio_share: 0.5}
"""


def turning() -> list[Sample]:
    """Six road users of all kinds on circles; one of them comes back."""
    kinds = ("passenger", "DEFAULT_VEHTYPE", "bus", "DEFAULT_BIKETYPE", "pedestrian", "trailer")
    return [
        Sample(
            id=f"{kind} {k}",
            time=j / 10,
            x=round(30 * k + 7.1 * np.cos(0.31 * j), 2),
            y=round(7.1 * np.sin(0.31 * j), 2),
            heading=round(360.0 - np.degrees(0.31 * j) % 360.0, 2),
            speed=round(22.01 + 0.1 * j, 2),
            type=kind,
        )
        for j in range(26)
        for k, kind in enumerate(kinds)
        if not (k == 2 and 3 < j < 24)
    ]


def run(folder: Path, file: Path, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    """The fingerprint of a run in which `file` is replayed."""
    scenario = folder / "replay.yaml"
    scenario.write_text(SCENARIO.replace("FILE", file.name))
    out = str(folder / f"run-{file.name}-{len(options)}")
    assert (
        main(["run", str(scenario), "--seed", "5", "--no-figure", "--out", out, "--json", *options])
        == 0
    )
    found: str = json.loads(capsys.readouterr().out)["fingerprint"]
    return found


def test_equal_traces_give_equal_runs_in_all_formats(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow.parquet", exc_type=ImportError)
    samples = turning()
    files = [
        write_fcd(tmp_path / "a.xml", samples),
        write_fcd(tmp_path / "a.xml.gz", samples),
        write_csv(tmp_path / "a.csv", samples),
        write_csv(tmp_path / "b.csv", samples, ";"),
        write_parquet(tmp_path / "a.parquet", samples),
    ]
    zipped = tmp_path / "c.csv.gz"
    zipped.write_bytes(gzip.compress(files[2].read_bytes()))
    found = [run(tmp_path, file, capsys) for file in [*files, zipped]]
    found.append(run(tmp_path, zipped, capsys, "--transport", "loopback"))
    assert len(set(found)) == 1


def test_who_rides_is_no_body_of_its_own(tmp_path: Path) -> None:
    """As SUMO writes it with the attribute `vehicle`, and without."""
    place = 'x="1" y="2" angle="3" speed="4"'
    persons = [
        f'<person id="p" {place} vehicle="a"/>',
        f'<person id="p" {place}/>',
        f'<person id="p" {place} vehicle=""/>',
        '<person id="p" x="1" y="2" angle="3" speed="0"/>',
    ]
    bodies = []
    for person in persons:
        file = tmp_path / "a.xml"
        file.write_text(
            f'<fcd-export><timestep time="0"><vehicle id="a" {place} type="bus"/>{person}'
            "</timestep></fcd-export>"
        )
        (found,) = states(replay(file), "0.1", 0)
        bodies.append(array(found, "body").tolist())
    assert bodies == [[3], [3], [3, 8], [3, 8]]


def test_containers_are_left_out_which_the_log_says_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """As `sumo-traffic` has it: loads are no road users."""
    place = 'x="1" y="{}" angle="3" speed="4"'
    times = "".join(
        f'<timestep time="{k}"><vehicle id="a" {place.format(2)} type="bus"/>'
        f'<container id="c" {place.format(7)} type="DEFAULT_CONTAINERTYPE"/>'
        f'<container id="d" {place.format(2)}/></timestep>'
        for k in range(2)
    )
    file = tmp_path / "a.xml"
    file.write_text(f"<fcd-export>\n{times}</fcd-export>")
    component = replay(file, equip_persons=True)
    with caplog.at_level("INFO"):
        found = list(states(component, "1", 1))
    assert [array(signals, "body").tolist() for signals in found] == [[Body.BUS]] * 2
    assert [record.getMessage() for record in caplog.records] == [
        f"{file}:2:80: container `c` is left out, and so are all others: loads are no road users"
    ]


def test_a_vehicle_and_a_person_may_share_a_name(tmp_path: Path) -> None:
    """As SUMO allows it: each keeps its own number; two persons of one name are refused."""
    twins = '<{} id="a" x="{}" y="2" angle="3" speed="4" type="{}"/>'
    times = [
        [twins.format("vehicle", k, "bus"), twins.format("person", 50 + k, "DEFAULT_PEDTYPE")]
        for k in range(3)
    ]
    times[1].reverse()
    steps = [f'<timestep time="{k}">{"".join(those)}</timestep>' for k, those in enumerate(times)]
    file = tmp_path / "a.xml"
    file.write_text(f"<fcd-export>{''.join(steps)}</fcd-export>")
    found = list(states(replay(file), "1", 2))
    assert entered(found[0]) == [(0, "a", "bus"), (1, "a", "DEFAULT_PEDTYPE")]
    assert [array(signals, "body").tolist() for signals in found] == [[3, 8]] * 3
    assert [entered(signals) for signals in found[1:]] == [[], []]
    file.write_text(file.read_text().replace("vehicle", "person"))
    assert refused({"file": file}).count("`a` is there 2 times at the same time") == 3


@pytest.mark.slow
def test_a_large_file_is_read_piece_by_piece(tmp_path: Path) -> None:
    """Of 8,000 times only those within the gap are ever held."""
    samples = [Sample(id=f"v{j // 100}", time=j / 10) for j in range(8_000)]
    component = replay(write_fcd(tmp_path / "a.xml", samples), maximum_gap=1.0)
    seen = 0
    for seen, _ in enumerate(states(component, "2", 399)):  # noqa: B007
        window = component._window
        assert window is not None
        assert len(window._ahead) <= 12
        assert len(window._held) <= 2
        assert len(window._roster._users) <= 1024
    assert seen == 399


def test_sizes_are_those_of_the_columns_then_of_the_types_file_then_of_sumo(
    tmp_path: Path,
) -> None:
    types = tmp_path / "types.xml"
    types.write_text(
        '<additional><vType id="mine" vClass="truck" length="9"/>'
        '<vTypeDistribution id="d"><vType id="tall" height="1.7" width="2"/></vTypeDistribution>'
        '<vType id="pole"><param key="antenna_height" value="3.5"/>'
        '<param key="body" value="van"/></vType>'
        '<vType id="bus" vClass="bus" length="18"/></additional>'
    )
    file = tmp_path / "a.csv"
    file.write_text(
        "id,time,x,y,heading,speed,type,length,height,lane\n"
        "a,0,0,0,0,1,mine,,,x\nb,0,0,0,0,1,mine,8.5,3.1,x\nc,0,0,0,0,1,tall,,,\n"
        "d,0,0,0,0,1,pole,,2,\ne,0,0,0,0,1,bus,,,\nf,0,0,0,0,1,mine@f,,,\n"
    )
    (found,) = states(replay(file, types_file=types, antenna_above_roof=0.1), "0.1", 0)
    sizes = [
        [9, 2.4, 2.4],
        [8.5, 2.4, 3.1],
        [5, 2, 1.7],
        [5, 1.8, 2],
        [18, 2.5, 3.4],
        [9, 2.4, 2.4],
    ]
    np.testing.assert_array_equal(array(found, "size"), sizes)
    np.testing.assert_allclose(array(found, "antenna_height"), [2.5, 3.2, 1.8, 3.5, 3.5, 2.5])
    bodies = [Body.TRUCK, Body.TRUCK, Body.SUV, Body.VAN, Body.BUS, Body.TRUCK]
    assert array(found, "body").tolist() == bodies


def buildings(path: Path) -> Path:
    path.write_text(
        '<additional><poly id="a" type="building" shape="0,0 10,0 10,5 0,5 0,0">'
        '<param key="height" value="21"/></poly>'
        '<poly id="tree" type="natural" shape="0,0 1,1 2,0"/>'
        '<poly id="b" type="building.retail" shape="20,0 30,0 30,5"/></additional>'
    )
    return path


def test_buildings_are_open_rings_with_heights(tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", [Sample(id="a", time=0.0)])
    drawn = buildings(tmp_path / "b.xml")
    (found,) = states(replay(file, buildings=drawn, building_height=7.0), "0.1", 0)
    corners = [[0, 0], [10, 0], [10, 5], [0, 5], [20, 0], [30, 0], [30, 5]]
    np.testing.assert_array_equal(found["building.vertex"], corners)
    np.testing.assert_array_equal(found["building.index"], [0, 0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(found["building.height"], [21.0, 7.0])
    assert np.size(found["road.vertex"]) == 0


def test_what_may_not_be_meant_is_remarked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of buildings and the net, by `check` and `run`, and anew when a file has changed."""
    scenario, drawn, net = (tmp_path / name for name in ("replay.yaml", "b.xml", "n.xml"))
    file = write_csv(tmp_path / "a.csv", [Sample(id="a", time=0.1 * j) for j in range(21)])
    net.write_text(
        '<net><edge id="e"><lane id="e_0" shape="0,0 9,0"/>\n'
        '<lane id="e_1" shape="0,3,-0.5 9,3,6.25"/><lane id="e_2" shape="0,3 9,3"/>\n'
        "</edge></net>"
    )
    text = SCENARIO.replace("FILE", f"{file.name}, buildings: {drawn.name}, net: {net.name}")
    scenario.write_text(text.replace("reference: front, ", ""))
    trees = '<poly type="tree" shape="0,0 1,1 2,0"/>\n<poly type="tree" shape="0,0 1,1 2,0"/>\n'
    house = '<poly id="a" type="building" shape="0,0 9,0 9,5">'
    height = '<param key="height" value="3"/>'
    heights = "n.xml:2:1: the net says heights from -0.5 m to 6.25 m: the ground is taken as flat"
    for polygons, expected in (
        (
            f"{trees}{house}</poly>\n{house}{height}</poly>\n{house}</poly>",
            [
                "b.xml:1:13: 2 polygons of type `tree` are no buildings",
                "b.xml:3:1: 2 of 3 buildings say no height and are taken as 10 m high",
            ],
        ),
        (
            f'<poly shape="0,0"/>\n{house}</poly>',
            [
                "b.xml:1:13: 1 polygon without a type is no building",
                "b.xml:2:1: 1 of 1 buildings says no height and is taken as 10 m high",
            ],
        ),
        (f"{house}{height}</poly>", []),
    ):
        drawn.write_text(f"<additional>{polygons}</additional>")
        assert main(["check", str(scenario)]) == 0
        checked = capsys.readouterr().out
        out = tmp_path / f"out-{len(polygons)}"
        assert main(["run", str(scenario), "--out", str(out), "--no-figure"]) == 0
        logged = (out / "log.txt").read_text()
        for what in (*expected, heights):
            assert what in checked
            assert what in logged
        assert checked.count("b.xml:") == len(expected)


def test_buildings_in_degrees_are_refused(tmp_path: Path) -> None:
    """They would stand some metres from the origin."""
    file = write_csv(tmp_path / "a.csv", [Sample(id="a", time=0.0)])
    drawn = tmp_path / "b.xml"
    for geo, is_refused in (("true", True), ("1", True), ("false", False), ("0", False)):
        drawn.write_text(
            '<additional>\n<poly id="a" type="building" shape="11.5,48 11.6,48 11.6,48.1" '
            f'geo="{geo}"/></additional>'
        )
        if is_refused:
            said = refused({"file": file, "buildings": drawn})
            assert "b.xml:2:1: building `a` is in degrees (`geo`); metres of the net" in said
        else:
            replay(file, buildings=drawn)


def refused(parameters: dict[str, Any]) -> str:
    with pytest.raises(ComponentTypeError) as caught:
        replay(**parameters)
    return str(caught.value)


HEADER = "id,time,x,y,heading,speed,type"


WRONG: Final[Sequence[tuple[str, str, str]]] = (
    (
        "a.xml",
        "<routes>\n</routes>",
        "a.xml:1:1: `<routes>` is not SUMO's FCD output, whose root is `<fcd-export>`",
    ),
    (
        "a.xml",
        """<fcd-export>
 <timestep time="0">
  <vehicle id="a" x="1" y="nan" angle="0" type="bus"/>
  <vehicle id="a" x="?" y="1" angle="0" speed="0"/>
  <trip/>
 </timestep>
 <timestep time="x"/>
 <timestep time="0.0"/>
</fcd-export>""",
        """a.xml:3:3: `y` is `nan`, a finite number is needed
a.xml:3:3: `speed` is missing, a finite number is needed
a.xml:4:3: `type` is missing
a.xml:4:3: `a` is there 2 times at the same time
a.xml:4:3: `x` is `?`, a finite number is needed
a.xml:5:3: `<trip>` in `<timestep>` is no element of SUMO's FCD output
a.xml:7:2: `time` is `x`, no number of seconds
a.xml:8:2: time 0 s comes after 0 s; the file must be sorted by time""",
    ),
    (
        "a.xml",
        '<fcd-export>\n <timestep time="0">\n  <vehicle',
        "a.xml:3:3: is not well-formed XML: unclosed token",
    ),
    ("a.xml", "<fcd-export/>", "a.xml:1:1: there is no sample in this file"),
    ("a.xml.gz", "plain", "a.xml.gz:1:1: cannot be read: Not a gzipped file (b'pl')"),
    ("a.csv", "", "a.csv:1:1: there is no line that names the columns"),
    (
        "a.csv",
        "id;time;x;y;angle;speed;typ;lenght\n",
        """a.csv:1:1: there is no column `heading`; there are: id, time, x, y, angle, ...
a.csv:1:1: there is no column `type`; is `typ` meant?
a.csv:1:1: column `lenght` is not known; is `length` meant?""",
    ),
    (
        "a.csv",
        f"{HEADER},x\na,0,0,0,0,0,bus,0\n",
        "a.csv:1:1: the column `x` is there twice",
    ),
    (
        "a.csv",
        f'{HEADER}\na,0,0,0,0,0,bus\nb,0,0,0,0,0,"{"x" * 140_000}"\n',
        "a.csv:3:1: is no line of a CSV file: field larger than field limit (131072)",
    ),
    (
        "a.csv",
        f"""{HEADER},width
a,1,0,0,0,0,bus,-2
z,1,0,0,0,0,bus,0
b,0.5,0,0,0,0,bus,
b,0.5,inf,0,0,0,bus,1
c,,0,0,0,0,bus,1
d,2,0
""",
        """a.csv:2:1: `width` is `-2`, a positive number of metres is needed
a.csv:3:1: `width` is `0`, a positive number of metres is needed
a.csv:4:1: time 0.5 s comes after 1 s; the file must be sorted by time
a.csv:5:1: `b` is there 2 times at the same time
a.csv:5:1: `x` is `inf`, a finite number is needed
a.csv:6:1: `time` is missing
a.csv:7:1: 3 cells, but there are 8 columns""",
    ),
    (
        "a.csv",
        f"{HEADER}\na,0,0,0,0,0,buss\nb,0,0,0,0,0,xyz\na,1,0,0,0,0,buss\nc,1,0,0,0,0,xyz\n",
        """a.csv:2:1: type `buss` of 1 road user is not known; did you mean `bus`? ...
a.csv:3:1: type `xyz` of 2 road users is not known; declare it in the file of `types_file`, ...""",
    ),
    ("a.txt", "", "`file`: `a.txt` is of no known format; ..."),
    (
        "a.csv",
        f"{HEADER}\na,0,0,0,0,0,bus\na,5,0,0,0,0,bus\n",
        "a.csv: the first two times are 5 s apart, more than `maximum_gap` = 2 s, ...",
    ),
)


@pytest.mark.parametrize(("name", "text", "expected"), WRONG)
def test_what_is_wrong_with_a_file_is_said_with_its_place(
    tmp_path: Path, name: str, text: str, expected: str
) -> None:
    """Ends of lines that are left open here are `...`."""
    (tmp_path / name).write_text(text)
    found = refused({"file": tmp_path / name}).replace(f"{tmp_path}/", "")
    pattern = re.escape(expected).replace(re.escape("..."), ".*")
    assert re.fullmatch(pattern, found), found


@pytest.mark.parametrize(
    ("cell", "time"),
    [
        (" 0.1 ", 100_000_000),
        (0.1, 100_000_000),
        ("1e-9", 1),
        ("0.0000000015", 2),
        (-3, -3_000_000_000),
        ("4e9", 4 * 10**18),
        ("-4e9", -4 * 10**18),
        ("4000000000.000000001", None),
        (4.1e9, None),
        ("1e400", None),
        ("inf", None),
        (float("nan"), None),
        ("0:01", None),
        ("", None),
        (None, None),
    ],
)
def test_times_are_decimal_seconds_that_fit_into_nanoseconds(
    cell: object, time: int | None
) -> None:
    """To the nearest one, up to four thousand million seconds in both directions."""
    assert file_time(cell) == time


def test_of_many_problems_twenty_are_shown(tmp_path: Path) -> None:
    rows = [f"v{k},0,x,0,0,0,bus" for k in range(33)]
    (tmp_path / "a.csv").write_text("\n".join([HEADER, *rows]))
    lines = refused({"file": tmp_path / "a.csv"}).splitlines()
    assert len(lines) == 21
    assert lines[-1] == "... and 13 more problems in this file"


def test_a_file_of_types_has_the_root_of_one(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"{HEADER}\na,0,0,0,0,0,bus\n")
    (tmp_path / "t.xml").write_text('\n <net><vType id="mine"/></net>')
    text = refused({"file": tmp_path / "a.csv", "types_file": tmp_path / "t.xml"})
    expected = "t.xml:2:2: `<net>` is no SUMO file of types, whose root is `<additional>`"
    assert text.endswith(expected)


def test_what_is_wrong_with_types_and_surroundings_is_said_at_once(tmp_path: Path) -> None:
    types, drawn, net = (tmp_path / name for name in ("t.xml", "b.xml", "n.xml"))
    types.write_text(
        '<additional>\n<vType id="a" vClass="lorry" length="-1"/>\n<vType id="a"/>\n<vType>\n'
        '<param key="body" value="box"/>\n<param key="antenna_height"/></vType>\n</additional>'
    )
    drawn.write_text(
        '<additional>\n<poly id="a" type="building" shape="0,0 1,1"/>\n'
        '<poly id="b" type="building" shape="0,x 1,1 2,0">\n'
        '<param key="height" value="0"/></poly>\n'
        "</additional>"
    )
    net.write_text(
        '<net>\n<edge id="e">\n<lane id="e_0" shape="0,0 0,0" width="x"/>\n'
        '<lane id="e_1" shape="0"/>\n<lane id="e_2" allow="tram" shape="0"/>\n</edge>\n</net>'
    )
    text = refused(
        {
            "file": tmp_path / "a.csv",
            "types_file": types,
            "buildings": drawn,
            "net": net,
            "maximum_gap": 0.1234567891,
        }
    ).replace(f"{tmp_path}/", "")
    for expected in (
        "`maximum_gap`: 0.1234567891 s is not a whole number of nanoseconds",
        "t.xml:3:1: type `a` is declared twice",
        "t.xml:4:1: `id` of this `<vType>` is missing",
        "t.xml:5:1: `body` is `box`; there are: bicycle, bus",
        "t.xml:6:1: `antenna_height` is missing, a positive number of metres is needed",
        "b.xml:2:1: building `a` has 2 corners, at least 3 are needed",
        "b.xml:3:1: `shape` of building `b` is no list of points, as in `0,0 10,0 10,5`",
        "b.xml:4:1: `height` is `0`, a positive number of metres is needed",
        "n.xml:3:1: `shape` of this lane has fewer than two points",
        "n.xml:3:1: `width` is `x`, a positive number is needed",
        "n.xml:4:1: `shape` of lane `e_1` is no list of points, as in `0,0 10,0`",
    ):
        assert expected in text
    assert "e_2" not in text  # no passenger car may use it


def test_a_run_outside_of_the_file_is_refused_unless_wanted(tmp_path: Path) -> None:
    samples = [Sample(id="a", time=t) for t in (10.0, 11.0)]
    file = write_csv(tmp_path / "a.csv", samples)
    with pytest.raises(ComponentTypeError, match=r"begins at 10 s and .*`offset` is 0 s"):
        list(states(replay(file), "0.5", 1))
    with pytest.raises(ComponentTypeError, match=r"begins at 10 s and ends at 11 s; .* 11.5 s"):
        list(states(replay(file, offset=10.0), "0.5", 3))
    found = list(states(replay(file, offset=9.5, outside="empty"), "0.5", 4))
    assert [len(array(signals, "id")) for signals in found] == [0, 1, 1, 1, 0]


def test_parquet_without_its_extra_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    (tmp_path / "a.parquet").write_bytes(b"")
    assert "pip install 'nlosim[parquet]'" in refused({"file": tmp_path / "a.parquet"})


def test_a_damaged_parquet_file_is_named(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow.parquet", exc_type=ImportError)
    (tmp_path / "a.parquet").write_bytes(b"PAR1 no table PAR1")
    assert "a.parquet:1:1: cannot be read: " in refused({"file": tmp_path / "a.parquet"})


def test_default_types_are_of_known_classes() -> None:
    assert set(DEFAULT_TYPES.values()) <= set(CLASSES)


def test_an_encoding_that_python_does_not_know_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(b'<?xml version="1.0" encoding="nowhere"?><fcd-export/>')
    with pytest.raises(ComponentTypeError, match=r"a.xml:1:1: is not well-formed XML: unknown enc"):
        list(replay(path)._source.frames())
