"""Writer of OpenDRIVE 1.8: any town as roads with lane sections, junctions, signals, sidewalks and crosswalks."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree

from dorothie_gym.errors import TownError
from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.opendrive.cross_sections import cross_sections
from dorothie_gym.maps.opendrive.own_data import PROGRAMME, VENDOR
from dorothie_gym.maps.opendrive.road_elements import RoadElements, number, rounded
from dorothie_gym.maps.opendrive.road_layout import RoadLayout, lay_roads
from dorothie_gym.maps.opendrive.road_links import RoadLinks, link_roads
from dorothie_gym.maps.opendrive.roadside import Roadside
from dorothie_gym.support.files import write_atomically

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.cross_sections import CrossSection
    from dorothie_gym.maps.opendrive.elements import Element
    from dorothie_gym.maps.town import LightProgramme, Town

# Number of roads' layouts that are tried: after the first, lanes whose links cannot be stated get roads of their own.
_TRIES = 3


def write_opendrive(town: Town, path: str | Path) -> None:
    """Writes a town to an OpenDRIVE file (see `opendrive_text`), whole or not at all.

    Raises:
        TownError: as in `opendrive_text`.
        OSError: the file cannot be written.
    """
    write_atomically(Path(path), opendrive_text(town))


def opendrive_text(town: Town) -> bytes:
    """Returns a town as an OpenDRIVE 1.8 file, which `read_opendrive` reads back as the same town.

    Centre lines keep within 1 cm, links, lane changes, speed limits, signals, light programmes, streets, sidewalks and
    crosswalks are the same. Lanes with one road id are lanes of one road, also where a turn lane opens beside them.
    Landmark sites are not written: a reader infers them.

    Raises:
        TownError: lanes are linked in a way that OpenDRIVE cannot state.
    """
    keeps_left = town.traffic is DrivingSide.LEFT
    roads, sections, links = _laid_out(town, keeps_left)
    roadside = Roadside(roads, sections)
    for signal in town.signals:
        roadside.add_signal(signal)
    for crosswalk in town.crosswalks:
        roadside.add_crosswalk(crosswalk)
    root = etree.Element("OpenDRIVE")
    _write_header(root, town)
    elements = RoadElements(town, links, keeps_left=keeps_left)
    order = sorted(range(len(roads)), key=lambda k: (roads[k].street < 0, roads[k].street, roads[k].number))
    for k in order:  # a reader meets the streets in their order
        found = roads[k].number
        elements.write(root, roads[k], sections[k], roadside.crosswalks[found], roadside.signals[found])
    controllers = _write_controllers(root, town)
    _write_junctions(root, town, links, controllers)
    etree.indent(root)
    text: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    return text


def _laid_out(town: Town, keeps_left: bool) -> tuple[list[RoadLayout], list[tuple[CrossSection, ...]], RoadLinks]:
    apart: set[int] = set()
    changes = frozenset((link.source, link.target) for link in town.links if link.type.is_lane_change)
    for _ in range(_TRIES):
        roads = lay_roads(town, keeps_left=keeps_left, apart=apart)
        sections = [cross_sections(road, changes, keeps_left=keeps_left) for road in roads]
        links = link_roads(roads, sections, town.links)
        if not links.missing:
            return roads, sections, links
        apart |= links.missing
    lane = town.lanes[min(links.missing)]
    raise TownError(
        town.name,
        f"road {lane.road_id} / lane {lane.lane_id}",
        "is linked with several roads outside of junctions, which OpenDRIVE cannot state",
    )


def _write_header(root: Element, town: Town) -> None:
    points = np.concatenate([lane.points[:, :2] for lane in town.lanes])
    (west, north), (east, south) = points.min(axis=0), points.max(axis=0)
    header = {"revMajor": "1", "revMinor": "8", "name": town.name, "version": "1.00", "vendor": VENDOR}
    box = {"north": -north, "south": -south, "east": east, "west": west}
    etree.SubElement(root, "header", header | {name: rounded(value) for name, value in box.items()})


# --- Junctions and lights --------------------------------------------------------------------------------------------


def _write_controllers(root: Element, town: Town) -> dict[int, list[int]]:
    """Adds a controller for the lights of a junction that always show one colour; returns their ids by junction."""
    found: defaultdict[int, list[int]] = defaultdict(list)
    count = 0
    for programme in town.programmes:
        groups: defaultdict[tuple[str, ...], list[int]] = defaultdict(list)
        for signal in programme.signals:
            groups[tuple(str(phase.colour(signal)) for phase in programme.phases)].append(signal)
        for signals in groups.values():
            controller = etree.SubElement(root, "controller", {"id": str(count), "name": f"lights {count}"})
            for signal in signals:
                etree.SubElement(controller, "control", {"signalId": str(signal), "type": "0"})
            found[programme.junction_id].append(count)
            count += 1
    return found


def _write_junctions(root: Element, town: Town, links: RoadLinks, controllers: dict[int, list[int]]) -> None:
    programmes = {programme.junction_id: programme for programme in town.programmes}
    for junction in sorted(town.junctions, key=lambda junction: junction.id):
        element = etree.SubElement(root, "junction", {"id": str(junction.id), "name": f"junction {junction.id}"})
        for k, connection in enumerate(links.connections.get(junction.id, ())):
            attributes = {
                "id": str(k),
                "incomingRoad": str(connection.incoming.road),
                "connectingRoad": str(connection.connecting.road),
                "contactPoint": connection.connecting.contact,
            }
            found = etree.SubElement(element, "connection", attributes)
            for source, target in connection.lanes:
                etree.SubElement(found, "laneLink", {"from": str(source), "to": str(target)})
        for sequence, controller in enumerate(controllers.get(junction.id, ())):
            etree.SubElement(element, "controller", {"id": str(controller), "type": "0", "sequence": str(sequence)})
        if junction.id in programmes:
            _write_programme(element, programmes[junction.id])


def _write_programme(junction: Element, programme: LightProgramme) -> None:
    data = etree.SubElement(junction, "userData", {"code": PROGRAMME, "value": number(programme.offset)})
    for phase in programme.phases:
        colours = {"green": phase.green, "yellow": phase.yellow}
        lit = {name: " ".join(str(signal) for signal in signals) for name, signals in colours.items() if signals}
        etree.SubElement(data, "phase", {"duration": number(phase.duration), **lit})
