"""A small run of everything that exports read: three vehicles, a person, lidars, radios."""

from pathlib import Path
from typing import Final

from orchestrator.cli import main

TRAFFIC: Final = """\
id,time,x,y,heading,speed,type
red car,0,-60,-2,0,15,passenger
white van,0,-20,-2,0,0,delivery
bus,0,70,2,180,12,bus
walker,0,0,-6,90,1,pedestrian
red car,1,-45,-2,0,15,passenger
white van,1,-20,-2,0,0,delivery
bus,1,58,2,180,12,bus
walker,1,0,-5,90,1,pedestrian
red car,2,-30,-2,0,15,passenger
white van,2,-20,-2,0,0,delivery
bus,2,46,2,180,12,bus
"""
HOUSE: Final = """\
<additional>
    <poly id="house" type="building" shape="-10,8 30,8 30,20 -10,20">
        <param key="height" value="12"/></poly>
</additional>
"""
SCENARIO: Final = """\
schema: 1
title: A street from a file
time: {start: 0 s, stop: 2 s}
coupling:
  algorithm: gauss-seidel
  order: [road, scanner, air, messages]
components:
  road:
    type: fcd-replay
    step: 100 ms
    parameters: {file: street.csv, lidar_share: 1, buildings: street.poly.xml}
  scanner:
    type: lidar
    step: 200 ms
    parameters: {channels: 4, azimuths: 90, range_noise: 0 m}
  messages:
    type: facilities
    step: 20 ms
  air:
    type: channel
    step: 20 ms
connections:
  - {from: road.vehicle, to: scanner.vehicle}
  - {from: road.building, to: scanner.building}
  - {from: road.vehicle, to: messages.vehicle}
  - {from: road.vehicle, to: air.vehicle}
  - {from: road.building, to: air.building}
  - {from: messages.packets, to: air.packets}
  - {from: air.receptions, to: messages.receptions}
measures: {}
"""


def run_street(folder: Path) -> Path:
    """Run it in `folder`, and return the directory of the run."""
    (folder / "street.csv").write_text(TRAFFIC)
    (folder / "street.poly.xml").write_text(HOUSE)
    (folder / "street.yaml").write_text(SCENARIO)
    out = folder / "run"
    assert (
        main(["run", str(folder / "street.yaml"), "--no-figure", "--out", str(out), "--quiet"]) == 0
    )
    return out
