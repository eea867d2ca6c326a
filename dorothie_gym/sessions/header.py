"""What is known of a session before it begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypedDict

from dorothie_gym import __version__
from dorothie_gym.ontology import OntologyError, parse_landmark, parse_street
from dorothie_gym.sessions.encoding import canonical
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.fields import Fields

FORMAT_VERSION: Final = 1
"""Version of the layout of a session folder."""


class LandmarkRow(TypedDict):
    """A landmark of the town.

    `name` is its label; `lane` and `station` [m] are of its waypoint; `x` and `y` [m] where it stands; `street` the
    number of its street (-1: none); `hidden` whether the Co-Wizard does not know where it is.
    """

    name: str
    lane: int
    station: float
    x: float
    y: float
    street: int
    hidden: bool


class SubgoalRow(TypedDict):
    """A subgoal of the storyboard: `landmark` is a row of the landmarks, `after` holds numbers of subgoals."""

    description: str
    landmark: int
    after: Sequence[int]
    trigger: bool
    delete: bool
    change: str | None


@dataclass(frozen=True, kw_only=True)
class SessionHeader:
    """Town, storyboard, seed and configuration of a session. It holds no wall-clock time: equal runs, equal bytes.

    Attributes:
        town: name of the town.
        storyboard: name of the storyboard's template.
        seed: seed of the session; None where there was none (a session of another corpus).
        decision_frequency: decisions of the agents a second [Hz].
        street_names: label of the name of each street of the town.
        landmarks: everything that stands in the town.
        subgoals: the tasks, those to be triggered included.
        story: what the participant reads.
        departure: lane and station [m] where the car starts.
        config: configuration of the environment (JSON types).
        format_version: version of the layout.
        package_version: version of the package that wrote it.

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
    config: Mapping[str, Any] = field(default_factory=dict)
    format_version: int = FORMAT_VERSION
    package_version: str = __version__

    def __post_init__(self) -> None:
        """Checks the fields, and turns sequences into tuples so that a header equals what is read back."""
        plain = Fields(canonical({name: getattr(self, name) for name in _NAMES}, "header"), "header")
        if plain.integer("format_version") != FORMAT_VERSION:
            raise plain.error("format_version", f"{FORMAT_VERSION}, the only one this version of the package reads")
        for name in ("town", "storyboard", "story", "package_version"):
            plain.text(name)
        plain.optional("seed", plain.integer)
        if plain.number("decision_frequency") <= 0:
            raise plain.error("decision_frequency", "a positive number")
        object.__setattr__(self, "street_names", _streets(plain))
        landmarks = tuple(_landmark(row) for row in plain.objects("landmarks"))
        object.__setattr__(self, "landmarks", landmarks)
        object.__setattr__(self, "subgoals", tuple(_subgoal(row, len(landmarks)) for row in plain.objects("subgoals")))
        object.__setattr__(self, "departure", _departure(plain))
        object.__setattr__(self, "config", dict(plain.mapping("config")))

    def to_json(self) -> dict[str, Any]:
        """Returns the header in JSON types, fields always in the same order."""
        fields: dict[str, Any] = {name: canonical(getattr(self, name), f"header.{name}") for name in _NAMES}
        lane, station = self.departure
        return {**fields, "departure": {"lane": lane, "station": station}}

    @classmethod
    def from_json(cls, values: Mapping[str, Any], where: str = "header") -> SessionHeader:
        """Reads what `to_json` returned.

        Args:
            values: the JSON object.
            where: name of the file, for messages.

        Raises:
            SessionError: a field is missing or wrong; the message names the file and the field.
        """
        fields = Fields(values, where)
        departure = Fields(fields.mapping("departure"), f"{where}, departure")
        place = (departure.integer("lane", 0), departure.number("station"))
        try:
            return cls(**{**{name: fields.anything(name) for name in _NAMES}, "departure": place})
        except SessionError as error:
            raise SessionError(f"{where}: {error}") from None


_NAMES: Final = (
    "format_version",
    "package_version",
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
    return parts.integer("lane", 0), parts.number("station")


def _landmark(row: Fields) -> LandmarkRow:
    name = row.text("name")
    try:
        parse_landmark(name)
    except OntologyError as error:
        raise SessionError(f"{row.where}: field 'name': {error}") from None
    return LandmarkRow(
        name=name,
        lane=row.integer("lane", 0),
        station=row.number("station"),
        x=row.number("x"),
        y=row.number("y"),
        street=row.integer("street", -1),
        hidden=row.flag("hidden"),
    )


def _subgoal(row: Fields, landmarks: int) -> SubgoalRow:
    landmark = row.integer("landmark", 0)
    if landmark >= landmarks:
        raise row.error("landmark", f"a row of the {landmarks} landmarks")
    return SubgoalRow(
        description=row.text("description"),
        landmark=landmark,
        after=row.integers("after"),
        trigger=row.flag("trigger"),
        delete=row.flag("delete"),
        change=row.optional("change", row.text),
    )
