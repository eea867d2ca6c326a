"""OpenStreetMap files of small districts that tests draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

# Degrees per metre at the origin, which lies on the equator.
DEGREE = 1.0 / 111_319.49

TWO_WAY = {"highway": "residential"}


class Drawing:
    """OpenStreetMap file that is drawn in metres (x east, y north)."""

    def __init__(self) -> None:
        self._nodes: dict[str, str] = {}
        self._ways: list[str] = []

    def node(self, name: str, x: float, y: float, **tags: str) -> None:
        """Adds a node."""
        number = len(self._nodes) + 1
        place = f'lat="{0.0 + y * DEGREE:.9f}" lon="{x * DEGREE:.9f}"'
        self._nodes[name] = f'<node id="{number}" version="1" {place}>{_tags(tags)}</node>'

    def way(self, name: str, nodes: Sequence[str], tags: Mapping[str, str]) -> None:
        """Adds a way with a name; an empty name is left out."""
        numbers = {node: k for k, node in enumerate(self._nodes, start=1)}
        members = "".join(f'<nd ref="{numbers[node]}"/>' for node in nodes)
        named = {"name": name, **tags} if name else tags
        self._ways.append(f'<way id="{1000 + len(self._ways)}" version="1">{members}{_tags(named)}</way>')

    def text(self) -> str:
        """Returns the file."""
        content = "\n".join((*self._nodes.values(), *self._ways))
        return f'<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6">\n{content}\n</osm>\n'


def _tags(tags: Mapping[str, str]) -> str:
    return "".join(f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in tags.items())


def district() -> Drawing:
    """Returns a district: a grid of streets with lights, a one-way street, a bus lane, and a roundabout.

    "Rue de l'Église" runs one way to the east; "Bus Avenue" has a bus lane in each direction besides one for all;
    two crossings have lights; streets meet at a roundabout in the east.
    """
    drawing = Drawing()
    for i in range(3):
        for j in range(3):
            lit = {"highway": "traffic_signals"} if j == 1 and i < 2 else {}
            drawing.node(f"{i}{j}", 150.0 * i, 150.0 * j, **lit)
    ring = {"e": (18.0, 0.0), "n": (0.0, 18.0), "w": (-18.0, 0.0), "s": (0.0, -18.0)}
    for name, (x, y) in ring.items():
        drawing.node(f"ring {name}", 480.0 + x, 150.0 + y)
    drawing.way("Rue de l'Église", ["00", "10", "20"], {"highway": "residential", "oneway": "yes", "maxspeed": "30"})
    bus = {"highway": "secondary", "lanes": "4", "maxspeed": "50", "bus:lanes:forward": "yes|designated"}
    bus |= {"access:lanes:forward": "yes|no", "bus:lanes:backward": "yes|designated", "access:lanes:backward": "yes|no"}
    drawing.way("Bus Avenue", ["01", "11", "21", "ring w"], bus | {"lanes:forward": "2", "lanes:backward": "2"})
    drawing.way("North Street", ["02", "12", "22"], TWO_WAY)
    drawing.way("1st Street", ["00", "01", "02"], TWO_WAY)
    drawing.way("2nd Street", ["10", "11", "12"], TWO_WAY)
    drawing.way("Mill Lane", ["20", "21", "22"], TWO_WAY)
    drawing.way("", ["22", "ring n"], TWO_WAY)
    drawing.way("South Road", ["20", "ring s"], TWO_WAY)
    circle = ["ring e", "ring n", "ring w", "ring s", "ring e"]
    drawing.way("", circle, {"highway": "residential", "junction": "roundabout", "oneway": "yes"})
    return drawing
