"""Seeded mutations of OpenDRIVE files by their elements: wrong numbers, swapped ids, broken links, lost parts."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from random import Random
from typing import Final, TypeAlias

from lxml import etree

from tests.malformed.map_faults import FAULTS, encode

Element: TypeAlias = etree._Element

VALUES: Final = (
    "", " ", "0", "-0", "1", "-1", "2", "-2", "0.5", "1e-9", "-1e-9", "1e-320", "1e3", "1e5", "1e6", "1e9", "-1e9",
    "1e12", "1e308", "-1e308", "1e999", "nan", "inf", "-inf", "9" * 400, "0x10", "1,5", "½", "true", "none", "driving",
    "start", "end", "road", "junction", "LHT", "RHT", "a_b", "ü\u202e", "x" * 3000,
)  # fmt: skip
"""Values that replace those of attributes."""

FACTORS: Final = (-1.0, 0.0, 1e-9, 1e-3, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1e3, 1e6, 1e12)
"""Factors of numbers."""

SHIFTS: Final = (-100.0, -10.0, -1.0, -0.01, 0.01, 1.0, 10.0, 100.0, 3.14159, 1e4)
"""Summands of numbers."""

_MOST_ELEMENTS = 60_000
"""Elements beyond which a mutation adds no copies."""

_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")


def mutate_map(content: bytes, random: Random) -> bytes:
    """Returns a file with one to eight mutations of its elements; content that is no XML stays as it is."""
    try:
        root = etree.fromstring(content)
    except (etree.XMLSyntaxError, ValueError):
        return content
    for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
        random.choice(FAULTS if random.random() < 0.4 else _MUTATIONS)(root, random)
    written = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    return encode(written, random) if random.random() < 0.1 else written


def _pick(root: Element, random: Random) -> Element:
    """Returns an element below the root; each name is as likely as the others, however often it occurs."""
    names = sorted({str(element.tag) for element in root.iterdescendants("*")})
    if not names:
        return root
    name = random.choice(names)
    return random.choice(list(root.iterdescendants(name)))


def _attribute(root: Element, random: Random) -> tuple[Element, str] | None:
    """Returns an element and the name of one of its attributes, None if it has none."""
    element = _pick(root, random)
    names = sorted(map(str, element.keys()))
    return (element, random.choice(names)) if names else None


def _with_value(text: str, random: Random) -> str:
    """Returns a value in place of another one: mostly other numbers of its size in place of numbers."""
    if _NUMBER.fullmatch(text) and random.random() < 0.5:
        number = float(text)
        number = number * random.choice(FACTORS) if random.random() < 0.6 else number + random.choice(SHIFTS)
        return repr(int(number)) if "." not in text and number == number // 1 else repr(number)
    return random.choice(VALUES)


def _change(root: Element, random: Random) -> None:
    if (found := _attribute(root, random)) is not None:
        element, name = found
        element.set(name, _with_value(element.get(name, ""), random))


def _change_all(root: Element, random: Random) -> None:
    """Gives one value, or one factor, to an attribute of all elements of a name or of a part of them."""
    if (found := _attribute(root, random)) is None:
        return
    element, name = found
    share, factor = random.choice((0.1, 0.5, 1.0)), random.choice(FACTORS)
    value = random.choice(VALUES) if random.random() < 0.4 else None
    for other in root.iterdescendants(str(element.tag)):
        text = other.get(name)
        if text is None or random.random() >= share:
            continue
        if value is not None:
            other.set(name, value)
        elif _NUMBER.fullmatch(text):
            other.set(name, repr(float(text) * factor))


def _drop_attribute(root: Element, random: Random) -> None:
    if (found := _attribute(root, random)) is not None:
        del found[0].attrib[found[1]]


def _swap_values(root: Element, random: Random) -> None:
    """Swaps an attribute of two elements of one name: ids, links, lane numbers, positions."""
    if (found := _attribute(root, random)) is None:
        return
    element, name = found
    other = random.choice(list(root.iterdescendants(str(element.tag))))
    element.attrib[name], other.attrib[name] = other.get(name, ""), element.get(name, "")


def _same_values(root: Element, random: Random) -> None:
    """Gives an attribute of all elements of a name the values of others at random."""
    if (found := _attribute(root, random)) is None:
        return
    element, name = found
    others = [other for other in root.iterdescendants(str(element.tag)) if other.get(name) is not None]
    values = [other.get(name, "") for other in others]
    for other in others:
        other.set(name, random.choice(values))


def _drop(root: Element, random: Random) -> None:
    _remove(_pick(root, random))


def _drop_all(root: Element, random: Random) -> None:
    """Drops all elements of a name, or a part of them."""
    element, share = _pick(root, random), random.choice((0.1, 0.5, 0.9, 1.0))
    for other in list(root.iterdescendants(str(element.tag))):
        if random.random() < share:
            _remove(other)


def _remove(element: Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)


def _repeat(root: Element, random: Random) -> None:
    element = _pick(root, random)
    parent, size = element.getparent(), sum(1 for _ in element.iter())
    if parent is None:
        return
    for _ in range(min(random.choice((1, 1, 2, 30, 1000)), _MOST_ELEMENTS // size)):
        parent.insert(random.randrange(len(parent) + 1), copy.deepcopy(element))


def _shuffle(root: Element, random: Random) -> None:
    """Puts the children of an element into another order."""
    parent = _pick(root, random).getparent()
    if parent is not None:
        children = list(parent)
        random.shuffle(children)
        parent[:] = children


def _move(root: Element, random: Random) -> None:
    """Moves or copies an element into another one."""
    element, other = _pick(root, random), _pick(root, random)
    if element in (other, *other.iterancestors()):
        element = copy.deepcopy(element)
    elif random.random() < 0.3:
        element = copy.deepcopy(element)
    other.insert(random.randrange(len(other) + 1), element)


def _nest(root: Element, random: Random) -> None:
    """Nests an element in copies of itself without content."""
    element = _pick(root, random)
    parent = element.getparent()
    if parent is None:
        return
    place = parent.index(element)
    for _ in range(random.choice((1, 3, 200))):
        outer = etree.Element(str(element.tag), dict(element.attrib))
        outer.append(element)
        element = outer
    parent.insert(place, element)


def _rename(root: Element, random: Random) -> None:
    element, other = _pick(root, random), _pick(root, random)
    element.tag = random.choice((str(other.tag), "x", str(element.tag).upper()))


def _replace_contents(root: Element, random: Random) -> None:
    """Gives an element the children of another one of its name: lanes of another section, plan of another road."""
    element = _pick(root, random)
    other = random.choice(list(root.iterdescendants(str(element.tag))))
    if other is not element and element not in other.iterancestors() and other not in element.iterancestors():
        element[:] = [copy.deepcopy(child) for child in other]


_MUTATIONS: Final[tuple[Callable[[Element, Random], None], ...]] = (
    _change, _change, _change, _change, _change_all, _change_all, _drop_attribute, _swap_values, _swap_values,
    _same_values, _drop, _drop_all, _repeat, _shuffle, _move, _nest, _rename, _replace_contents,
)  # fmt: skip
