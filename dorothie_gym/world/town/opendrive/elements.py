"""The XML of an OpenDRIVE file: opening it, naming its elements, and reading attributes that make sense."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NoReturn, TypeAlias

import numpy as np
from lxml import etree

from dorothie_gym.world.town.errors import TownError
from dorothie_gym.world.town.opendrive.geometry import NO_CUBICS, Cubics

# The kind of XML node that lxml calls an element; its stubs name the class with an underscore.
Element: TypeAlias = etree._Element

# Metres per second in one unit; a limit without a unit is in m/s (OpenDRIVE 1.4, section 5.3.2.2).
SPEED_UNITS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}

# Elements that only group others: they are left out where an element is named.
_GROUPS = ("left", "right", "center", "lanes", "planView", "signals", "objects")


def describe(element: Element) -> str:
    """Name of an element for a person who looks for it, e.g. `road 12 / laneSection 0 / lane -1`."""
    parts = []
    for node in (*reversed(list(element.iterancestors())), element):
        parent = node.getparent()
        if parent is None or node.tag in _GROUPS:
            continue
        name = node.get("id")
        if name is None and len(siblings := parent.findall(node.tag)) > 1:
            name = str(siblings.index(node))
        parts.append(f"{node.tag} {name}" if name is not None else str(node.tag))
    where = " / ".join(parts) or str(element.tag)
    return f"{where} (line {element.sourceline})" if element.sourceline else where


class ElementReader:
    """Reads attributes of a file's elements; whatever is wrong is one `TownError` that names file and element.

    Attributes:
        source: the file, as its user named it.
    """

    def __init__(self, source: str) -> None:
        self.source = source

    def root(self) -> Element:
        """The outermost element; namespaces are taken off, for OpenDRIVE's names are its own."""
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            text = Path(self.source).read_bytes()
        except (OSError, ValueError) as error:  # ValueError: a null character in the path
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise TownError(self.source, "file", f"cannot be opened: {reason}") from error
        try:
            root = etree.fromstring(text, parser)
        except etree.XMLSyntaxError as error:
            line = f"line {error.lineno}" if error.lineno else "file"
            raise TownError(self.source, line, f"is not complete XML: {error.msg}") from error
        except ValueError as error:
            raise TownError(self.source, "file", f"is not XML: {error}") from error
        if str(root.tag).startswith("{"):
            for element in root.iter("*"):
                element.tag = etree.QName(element).localname
        if root.tag != "OpenDRIVE":
            self.fail(root, "is not an OpenDRIVE file; its outermost element must be OpenDRIVE")
        return root

    def fail(self, element: Element, reason: str) -> NoReturn:
        """Raises the error for an element."""
        raise TownError(self.source, describe(element), reason)

    def text(self, element: Element, name: str) -> str:
        """An attribute that has to be there."""
        text = element.get(name)
        if text is None:
            self.fail(element, f"attribute {name} is missing")
        return text

    def number(self, element: Element, name: str, default: float | None = None) -> float:
        """A finite number; an attribute that is missing is the default, if there is one."""
        if default is not None and element.get(name) is None:
            return default
        text = self.text(element, name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.fail(element, f"attribute {name} must be a number, not {text!r}")
        return value

    def integer(self, element: Element, name: str) -> int:
        """A whole number that has to be there."""
        text = self.text(element, name)
        try:
            return int(text)
        except ValueError:
            self.fail(element, f"attribute {name} must be a whole number, not {text!r}")

    def cubics(self, parent: Element, path: str, start: str) -> Cubics:
        """A profile: rows of where they start and four coefficients, in order of their starts."""
        rows = [[self.number(e, name) for name in (start, "a", "b", "c", "d")] for e in parent.iterfind(path)]
        return Cubics(np.array(sorted(rows, key=lambda row: row[0]))) if rows else NO_CUBICS

    def speed(self, element: Element) -> float | None:
        """Limit [m/s]; None where the file says that there is none or that it is not known."""
        if element.get("max", "") in ("no limit", "undefined"):
            return None
        unit = element.get("unit") or "m/s"
        if unit not in SPEED_UNITS:
            self.fail(element, f"attribute unit must be one of {', '.join(SPEED_UNITS)}, not {unit!r}")
        limit = self.number(element, "max") * SPEED_UNITS[unit]
        return limit if limit > 0.0 else None
