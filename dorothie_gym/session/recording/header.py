"""Session header: town, storyboard, seed and configuration, and the version of the format."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NotRequired, TypedDict

from dorothie_gym import __version__
from dorothie_gym.errors import OntologyError, SessionError, short_repr
from dorothie_gym.ontology.spellings import parse_landmark, parse_street
from dorothie_gym.session.recording.files import Fields, canonical, canonical_object

if TYPE_CHECKING:
    from dorothie_gym.support.files import JsonValue

NO_LANE: Final = -1
"""Lane number for an unknown lane."""


FORMAT_VERSION: Final = "2.0"
"""Version of the layout of a session folder, "major.minor".

Another minor version only adds fields, columns and types of events; another major version changes existing ones.
"""

NATIVE: Final = "dorothie_gym"
"""Source of the sessions that this package records."""

ANNOTATION_FIELD: Final = "annotation"
"""Field of `extra` of a copy with the labels of an annotator: annotator (name)."""

STREET_TITLES: Final = "street_titles"
"""Field of `extra` with the names that the map has for its streets, empty where it has none."""

_VERSION: Final = re.compile(r"(\d{1,4})\.(\d{1,4})")


def parse_version(value: object, where: str, current: str = FORMAT_VERSION) -> tuple[int, int]:
    """Returns major and minor number of the version of a file.

    Args:
        value: the file's version, "major.minor".
        where: name of the file, for messages.
        current: version that this package writes.

    Raises:
        SessionError: it is not a version, or its major number differs from the current one.
    """
    match = _VERSION.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise SessionError(f"{where}: field 'format_version' is {short_repr(value)}; it must be like \"{current}\"")
    major, minor = int(match[1]), int(match[2])
    ours = int(current.partition(".")[0])
    if major != ours:
        hint = ": update it" if major > ours else ""
        raise SessionError(
            f"{where}: format version {major}.{minor} cannot be read; this dorothie_gym reads {ours}.x{hint}"
        )
    return major, minor


def is_newer(version: str) -> bool:
    """Returns whether a version of a session is a later minor one than this package's."""
    return parse_version(version, "session") > parse_version(FORMAT_VERSION, "session")


class LandmarkRow(TypedDict):
    """Landmark of the town.

    `name` is its label; `lane` (-1: unknown) and `station` [m] are its waypoint; `x` and `y` [m] its position;
    `street` the number of its street (-1: none); `hidden` whether the Co-Wizard does not know its position; `extra`
    further fields (JSON types).
    """

    name: str
    lane: int
    station: float
    x: float
    y: float
    street: int
    hidden: bool
    extra: NotRequired[Mapping[str, object]]


class SubgoalRow(TypedDict):
    """Subgoal of the storyboard: `landmark` is a row of the landmarks, `after` holds numbers of subgoals.

    `extra` holds further fields (JSON types).
    """

    description: str
    landmark: int
    after: Sequence[int]
    trigger: bool
    delete: bool
    change: str | None
    extra: NotRequired[Mapping[str, object]]


@dataclass(frozen=True, kw_only=True)
class SessionHeader:
    """Town, storyboard, seed and configuration of a session. Without a wall-clock time, equal runs give equal bytes.

    Attributes:
        town: name of the town.
        storyboard: name of the storyboard's template; empty if unknown.
        seed: seed of the session; None for a session of another corpus.
        decision_frequency: decisions of the agents per second [Hz].
        street_names: label of the name of each street of the town.
        landmarks: landmarks of the town.
        subgoals: the tasks, including those that an exception may trigger.
        story: instructions that the participant reads.
        departure: lane (-1: unknown) and station [m] of the car's start.
        config: configuration of the environment (JSON types).
        format_version: version of the layout, "major.minor".
        package_version: version of the package that wrote the session.
        source: origin of the session: this package, or "sdn" and its layout ("sdn-release").
        extra: further fields (JSON types) of a newer minor version or of another corpus.

    Raises:
        SessionError: a field is not as described; the message names it.
    """

    town: str
    storyboard: str
    seed: int | None
    decision_frequency: float
    street_names: Sequence[str]
    landmarks: Sequence[LandmarkRow]
    subgoals: Sequence[SubgoalRow]
    story: str
    departure: tuple[int, float]
    config: Mapping[str, object] = field(default_factory=dict)
    format_version: str = FORMAT_VERSION
    package_version: str = __version__
    source: str = NATIVE
    extra: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks the fields and turns sequences into tuples, so that a header equals the one read back."""
        plain = Fields(canonical_object({name: getattr(self, name) for name in (*_NAMES, "extra")}, "header"), "header")
        parse_version(plain.text("format_version"), plain.where)
        for name in ("town", "storyboard", "story", "package_version", "source"):
            plain.text(name)
        plain.optional("seed", plain.seed)
        if plain.number("decision_frequency") <= 0:
            raise plain.error("decision_frequency", "a positive number")
        object.__setattr__(self, "street_names", _streets(plain))
        landmarks = tuple(_landmark(row) for row in plain.objects("landmarks"))
        object.__setattr__(self, "landmarks", landmarks)
        object.__setattr__(self, "subgoals", tuple(_subgoal(row, len(landmarks)) for row in plain.objects("subgoals")))
        object.__setattr__(self, "departure", _departure(plain))
        for name in ("config", "extra"):
            object.__setattr__(self, name, dict(plain.mapping(name)))
        clash = sorted(set(self.extra) & {*_NAMES, *RESERVED_NAMES})
        if clash:
            raise SessionError(f"{plain.where}: extra has {clash[0]!r}, which is a field of its own")

    @property
    def is_annotated(self) -> bool:
        """Whether people have annotated the dialogue: in other corpora, and in copies with the labels of annotators."""
        return self.source != NATIVE or ANNOTATION_FIELD in self.extra

    def to_json(self) -> dict[str, JsonValue]:
        """Returns the header in JSON types, fields in a fixed order."""
        fields = {name: canonical(getattr(self, name), f"header.{name}") for name in _NAMES}
        lane, station = self.departure
        extra = canonical_object(self.extra, "header.extra")
        return {**fields, "departure": {"lane": lane, "station": station}, **extra}

    @classmethod
    def from_json(cls, values: Mapping[str, object], where: str = "header") -> SessionHeader:
        """Returns the header of a JSON object; unknown fields become `extra`.

        Args:
            values: the JSON object.
            where: name of the file, for messages.

        Raises:
            SessionError: a field is missing or wrong; the message names the file and the field.
        """
        fields = Fields({"source": NATIVE, **values}, where)
        major, minor = parse_version(fields.anything("format_version"), where)
        departure = Fields(fields.mapping("departure"), f"{where}, departure")
        place = (departure.integer("lane", NO_LANE), departure.number("station"))
        given = {name: fields.anything(name) for name in _NAMES}
        extra = fields.others((*_NAMES, *RESERVED_NAMES))
        try:
            return cls(**{**given, "format_version": f"{major}.{minor}", "departure": place, "extra": extra})
        except SessionError as error:
            raise SessionError(f"{where}: {error}") from None


RESERVED_NAMES: Final = ("outcome", "counts")
"""Fields of `session.json` that are not part of the header."""

_NAMES: Final = (
    "format_version",
    "package_version",
    "source",
    "town",
    "storyboard",
    "seed",
    "decision_frequency",
    "street_names",
    "landmarks",
    "subgoals",
    "story",
    "departure",
    "config",
)


def _streets(fields: Fields) -> tuple[str, ...]:
    names = fields.texts("street_names")
    for name in names:
        try:
            parse_street(name)
        except OntologyError as error:
            raise SessionError(f"{fields.where}: field 'street_names': {error}") from None
    return names


def _departure(fields: Fields) -> tuple[int, float]:
    place = fields.anything("departure")
    if not isinstance(place, list) or len(place) != 2:
        raise fields.error("departure", "a lane and a station")
    parts = Fields({"lane": place[0], "station": place[1]}, f"{fields.where}, departure")
    return parts.integer("lane", NO_LANE), parts.number("station")


def _landmark(row: Fields) -> LandmarkRow:
    name = row.text("name")
    try:
        parse_landmark(name)
    except OntologyError as error:
        raise SessionError(f"{row.where}: field 'name': {error}") from None
    landmark = LandmarkRow(
        name=name,
        lane=row.integer("lane", NO_LANE),
        station=row.number("station"),
        x=row.number("x"),
        y=row.number("y"),
        street=row.integer("street", -1),
        hidden=row.flag("hidden"),
    )
    if extra := _extra(row, LandmarkRow.__required_keys__):
        landmark["extra"] = extra
    return landmark


def _extra(row: Fields, known: frozenset[str]) -> dict[str, object]:
    """Returns the unknown fields of a row, merged with its field `extra`."""
    return {**(row.if_given("extra", row.mapping) or {}), **row.others({*known, "extra"})}


def _subgoal(row: Fields, landmarks: int) -> SubgoalRow:
    landmark = row.integer("landmark", 0)
    if landmark >= landmarks:
        raise row.error("landmark", f"a row of the {landmarks} landmarks")
    subgoal = SubgoalRow(
        description=row.text("description"),
        landmark=landmark,
        after=row.integers("after"),
        trigger=row.flag("trigger"),
        delete=row.flag("delete"),
        change=row.optional("change", row.text),
    )
    if extra := _extra(row, SubgoalRow.__required_keys__):
        subgoal["extra"] = extra
    return subgoal
