"""Reader of XML elements: attributes as numbers and ids, faults as `TownError` with file, element and reason."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NoReturn, TypeAlias, TypeVar

import numpy as np
from lxml import etree

from dorothie_gym.errors import InputFileError, TownError, short_repr
from dorothie_gym.maps.import_notes import ImportNotes, NoteKind
from dorothie_gym.maps.model import NO_JUNCTION
from dorothie_gym.maps.opendrive.geometry import NO_CUBICS, Cubics
from dorothie_gym.maps.opendrive.ids import IdNumbers, plain_number
from dorothie_gym.support.input_files import MAX_OPENDRIVE, MAX_XML_ELEMENTS, read_file

T = TypeVar("T")

# Type of XML elements; the stubs of lxml name the class with an underscore.
Element: TypeAlias = etree._Element

# Metres per second of each unit; limits without a unit are in m/s (OpenDRIVE 1.4, section 5.3.2.2).
SPEED_UNITS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}

# Largest magnitude of a number. Ids, angles and metres of real maps stay far below it.
MAX_NUMBER = 2.0**40

# Elements of one name that are counted for messages, which name later ones by their lines.
_MOST_COUNTED = 1000

# Characters of an id that messages show.
_MOST_SHOWN = 60

# Grouping elements, which names of elements omit.
_GROUPS = ("left", "right", "center", "lanes", "planView", "signals", "objects")


def describe(element: Element) -> str:
    """Returns the name of an element for messages, e.g. `road 12 / laneSection 0 / lane -1`."""
    parts = []
    for node in (*reversed(list(element.iterancestors())), element):
        parent = node.getparent()
        if parent is None or node.tag in _GROUPS:
            continue
        name = node.get("id")
        if name is None:
            name = _place(node)
        parts.append(f"{node.tag} {name}" if name is not None else str(node.tag))
    where = " / ".join(parts) or str(element.tag)
    return f"{where} (line {element.sourceline})" if element.sourceline else where


def _place(element: Element) -> str | None:
    """Returns the index of an element among its siblings of the same name; None for an only one, or far behind."""
    before = sum(1 for _ in islice(element.itersiblings(element.tag, preceding=True), _MOST_COUNTED))
    only = before == 0 and next(element.itersiblings(element.tag), None) is None
    return None if only or before == _MOST_COUNTED else str(before)


class ElementReader:
    """Reader of the attributes of elements; raises `TownError` with file and element.

    Attributes:
        source: the file, as named by the user.
        notes: elements that were dropped or repaired, and values that were assumed.
        roads, junctions, signals: numbers of the ids of these elements; set by `number_ids`.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.notes = ImportNotes(source)
        self.roads = self.junctions = self.signals = IdNumbers(())

    def number_ids(self, root: Element) -> None:
        """Numbers the ids of all roads, junctions and signals."""
        self.roads = IdNumbers(_ids(root.iterfind("road"), "id"))
        crossed = (text for text in _ids(root.iterfind("road"), "junction") if plain_number(text) != NO_JUNCTION)
        self.junctions = IdNumbers((*_ids(root.iterfind("junction"), "id"), *crossed))
        self.signals = IdNumbers(_ids(root.iterfind("road/signals/signal"), "id"))
        for tag, numbers in (("road", self.roads), ("junction", self.junctions), ("signal", self.signals)):
            for text, number in numbers.renamed.items():
                self.notes.assumed(NoteKind.ID, f"{tag} {text}", f"is {tag} {number} of the town")

    def attempt(self, kind: NoteKind, read: Callable[[], T | None]) -> T | None:
        """Returns the result of a reader; None, with a note, if it cannot understand its element."""
        try:
            return read()
        except TownError as error:
            self.notes.dropped(kind, error.element, error.reason)
            return None

    def attempts(self, kind: NoteKind, elements: Iterable[Element], read: Callable[[Element], T | None]) -> Iterator[T]:
        """Yields what a reader makes of elements; those that it cannot understand are dropped with a note.

        A reader may leave out an element by returning None.
        """
        for element in elements:
            found = self.attempt(kind, functools.partial(read, element))
            if found is not None:
                yield found

    def root(self) -> Element:
        """Returns the root element; namespaces are removed from all names."""
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            text = read_file(Path(self.source), MAX_OPENDRIVE)
        except OSError as error:
            raise TownError(self.source, "file", f"cannot be opened: {error.strerror or error}") from error
        except InputFileError as error:
            raise TownError(self.source, "file", f"cannot be opened: {error.reason}") from None
        if text.count(b"<") > MAX_XML_ELEMENTS or text.count(b"=") > 8 * MAX_XML_ELEMENTS:
            raise TownError(self.source, "file", f"has more than {MAX_XML_ELEMENTS} elements; it is not read")
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
        """Returns a required attribute."""
        text = element.get(name)
        if text is None:
            self.fail(element, f"attribute {name} is missing")
        return text

    def number(self, element: Element, name: str, default: float | None = None) -> float:
        """Returns a finite number; a missing attribute gives the default, if there is one."""
        if default is not None and element.get(name) is None:
            return default
        text = self.text(element, name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= MAX_NUMBER:
            self.fail(element, f"attribute {name} must be a number up to {MAX_NUMBER:g}, not {short_repr(text)}")
        return value

    def integer(self, element: Element, name: str) -> int:
        """Returns a required integer."""
        text = self.text(element, name)
        try:
            value = int(text)
        except ValueError:
            value = None
        if value is None or not abs(value) <= MAX_NUMBER:
            self.fail(element, f"attribute {name} must be a whole number up to {MAX_NUMBER:g}, not {short_repr(text)}")
        return value

    def coefficient(self, element: Element, name: str) -> float:
        """Returns a finite number of any size: over a few micrometres, even trillions describe an ordinary curve."""
        text = self.text(element, name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.fail(element, f"attribute {name} must be a finite number, not {short_repr(text)}")
        return value

    def reference(self, element: Element, name: str, kind: str, numbers: IdNumbers) -> int:
        """Returns the number of the road, junction or signal that an attribute names."""
        text = self.text(element, name)
        number = numbers.get(text)
        if number is None:
            self.fail(element, f"attribute {name} refers to {kind} {text[:_MOST_SHOWN]}, which is not in the file")
        return number

    def cubics(self, parent: Element, path: str, start: str) -> Cubics:
        """Returns a profile: rows of start and four coefficients, sorted by start."""
        rows = [
            [*(self.number(e, name) for name in (start, "a")), *(self.coefficient(e, name) for name in "bcd")]
            for e in parent.iterfind(path)
        ]
        return Cubics(np.array(sorted(rows, key=lambda row: row[0]))) if rows else NO_CUBICS

    def speed(self, element: Element) -> float | None:
        """Returns a speed limit [m/s], or None if the file states that there is none or that it is unknown."""
        if element.get("max", "") in ("no limit", "undefined"):
            return None
        unit = element.get("unit") or "m/s"
        if unit not in SPEED_UNITS:
            self.fail(element, f"attribute unit must be one of {', '.join(SPEED_UNITS)}, not {short_repr(unit)}")
        limit = self.number(element, "max") * SPEED_UNITS[unit]
        return limit if limit > 0.0 else None

    def speeds(self, elements: Iterable[Element]) -> Iterator[tuple[Element, float]]:
        """Yields elements with the speed limit that they state [m/s]."""
        for element in elements:
            speed = self.attempt(NoteKind.SPEED, functools.partial(self.speed, element))
            if speed is not None:
                yield element, speed


def _ids(elements: Iterable[Element], name: str) -> Iterator[str]:
    return (str(text) for element in elements if (text := element.get(name)))
