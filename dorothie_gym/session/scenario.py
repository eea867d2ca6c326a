"""Scenario of a session, drawn from its seed: storyboard, street names, departure."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias, TypedDict

import gymnasium
import numpy as np
from msgspec import Meta

from dorothie_gym import dialogue, tasks  # lazy: words and storyboards are read when a session begins
from dorothie_gym.errors import SessionError, StoryboardError, did_you_mean, short_repr
from dorothie_gym.maps.site_inference import connected_sites
from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.session.recording.header import STREET_TITLES, SessionHeader, SubgoalRow
from dorothie_gym.session.talk_kinds import draw_talk_task
from dorothie_gym.session.talk_tasks import storyboard_of
from dorothie_gym.support.copying import shared
from dorothie_gym.support.input_files import checked, raising
from dorothie_gym.tasks.storyboard import Storyboard, StoryboardTemplate, Subgoal
from dorothie_gym.tasks.storyboard_specification import MOST_SEED, STOPS, StoryboardSource, StoryboardSpecification

if TYPE_CHECKING:
    from dorothie_gym.dialogue.street_titles import StreetTitles
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.tasks.briefs import TalkFamily

STREET_NAMES = tuple(
    name for name in StreetName if name not in (StreetName.UNKNOWN, StreetName.QUERIED, StreetName.HIGHWAY)
)
"""The fourteen names that are drawn for streets."""


class ReferencePage(TypedDict):
    """Reference of a scenario in JSON types; fields as in `ReferenceDrive`."""

    seconds: Annotated[float, Meta(ge=0.0, le=1e12)]
    exchanges: Annotated[int, Meta(ge=0, lt=2**31)]
    subgoals: Annotated[int, Meta(ge=0, lt=2**31)]


@shared
@dataclass(frozen=True, kw_only=True)
class ReferenceDrive:
    """Effort of the reference pair in a scenario, see `dorothie_gym.evaluation.rollout.reference_drives`.

    Attributes:
        seconds: simulated time until the destination [s].
        exchanges: number of exchanges of their dialogue.
        subgoals: number of live subgoals, all reached.
    """

    seconds: float
    exchanges: int
    subgoals: int

    def seconds_for(self, live: int) -> float:
        """Returns the reference time for a number of live subgoals: more in proportion if some were added [s]."""
        return self.seconds * max(1.0, live / self.subgoals) if self.subgoals else self.seconds

    def to_json(self) -> ReferencePage:
        """Returns the fields in JSON types."""
        return {"seconds": self.seconds, "exchanges": self.exchanges, "subgoals": self.subgoals}

    @classmethod
    def from_json(cls, row: ReferencePage) -> ReferenceDrive:
        """Parses the output of `to_json`."""
        return cls(**row)


REFERENCE: Final = "reference"
"""Field of `SessionHeader.extra` with the reference of the scenario (`ReferencePage`)."""


def recorded_reference(header: SessionHeader) -> ReferenceDrive | None:
    """Returns the reference of a recorded session's scenario; None if it was not measured.

    Raises:
        SessionError: the field of the header is damaged.
    """
    if REFERENCE not in header.extra:
        return None
    with raising(SessionError):
        page = checked(header.extra[REFERENCE], ReferencePage, f"header, {REFERENCE}")
    return ReferenceDrive.from_json(page)


@shared
@dataclass(frozen=True, kw_only=True)
class Scenario:
    """Initial conditions of a session.

    Attributes:
        seed: seed of the scenario, and of the session.
        storyboard: the task, bound to places of the town.
        street_names: name of each street of the town.
        departure: lane of the parked ego and the distance along it [m].
        street_titles: name of each street in the map, for towns whose names people see (`Town.street_titles`).
        reference: effort of the reference pair; None if it was not measured. It has no effect but on
            `EnvConfig.time_factor`.
    """

    seed: int
    storyboard: Storyboard
    street_names: tuple[StreetName, ...]
    departure: tuple[int, float]
    street_titles: tuple[str, ...] = ()
    reference: ReferenceDrive | None = None

    @cached_property
    def titles(self) -> StreetTitles:
        """Names of the map for the streets; false where the map has none."""
        return dialogue.StreetTitles(self.street_names, self.street_titles)

    @property
    def street_labels(self) -> list[str]:
        """What maps and boards call each street."""
        return self.titles.labels([name.label for name in self.street_names])


ResetOptions: TypeAlias = Mapping[str, object]
"""Options of an environment's `reset`."""


def check_options(options: ResetOptions | None, *known: str) -> None:
    """Warns of the options of a reset that an environment does not know; it ignores them."""
    for name in options or {}:
        if name not in known:
            hint = did_you_mean(str(name), known)
            gymnasium.logger.warn(
                f"reset option {short_repr(name)} is unknown and ignored; {hint}known: {', '.join(known)}"
            )


def scenario_option(options: ResetOptions | None) -> Scenario | None:
    """Returns the option `scenario` of a reset, or None; other options are ignored.

    Raises:
        ValueError: the option is not a `Scenario`.
    """
    scenario = (options or {}).get("scenario")
    if scenario is not None and not isinstance(scenario, Scenario):
        raise ValueError(f"option 'scenario' is a {type(scenario).__name__}; it must be a Scenario")
    return scenario


def template_option(storyboard: str | Path | StoryboardTemplate | None) -> StoryboardTemplate | None:
    """Returns the template that an argument `storyboard` names; None draws one of the shipped templates.

    Raises:
        StoryboardError: the template does not exist or is invalid.
        ValueError: the argument is of another type.
    """
    if storyboard is None or isinstance(storyboard, StoryboardTemplate):
        return storyboard
    if not isinstance(storyboard, str | Path):
        raise ValueError(
            f"storyboard is a {type(storyboard).__name__}; it must be a name, a path or a StoryboardTemplate"
        )
    return tasks.load_template(storyboard)


def draw_scenario(
    town: Town,
    template: StoryboardTemplate | None,
    seed: int,
    stops: tuple[int, int] | None = None,
    talk: TalkFamily | None = None,
    storyboards: StoryboardSource = StoryboardSource.SHIPPED,
) -> Scenario:
    """Draws a scenario; equal arguments give equal scenarios.

    Args:
        town: the map, with at least one site for each landmark of the storyboard.
        template: template of the storyboard; None draws one that fits the town.
        seed: any integer >= 0.
        stops: range of the number of stops of a drawn template, see `EnvConfig.stops`; None draws from all.
        talk: family of a talk task that replaces a drawn template, see `EnvConfig.talk`.
        storyboards: templates from which one is drawn, see `EnvConfig.storyboards`.

    Raises:
        StoryboardError: the template cannot be bound to the town, or none fits it.
    """
    task, streets, departure = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
    if talk is not None and template is None:
        return _talk_scenario(town, talk, seed, streets, departure)
    sites = connected_sites(town)
    if template is None and storyboards is StoryboardSource.GENERATED:
        template = _generated_template(town, stops or STOPS, task)
    if template is None and stops is not None:
        fitting = _with_stops(fitting_templates(town), stops, town)
        template = fitting[int(task.integers(len(fitting)))]
    if template is None:
        names = tasks.template_names()
        template = tasks.load_template(names[int(task.integers(len(names)))])
        if tasks.needed_places(template) > len(sites):
            fitting = fitting_templates(town)
            template = fitting[int(task.integers(len(fitting)))]
    storyboard = tasks.bind(template, sites, task)
    taken = {landmark.site for landmark in storyboard.landmarks}
    free = [site for site in sites if site.id not in taken] or list(sites)
    start = free[int(departure.integers(len(free)))]
    return Scenario(
        seed=seed,
        storyboard=storyboard,
        street_names=_name_streets(town, streets),
        departure=(start.lane, start.station),
        street_titles=_titles(town),
    )


def _talk_scenario(
    town: Town, family: TalkFamily, seed: int, streets: np.random.Generator, departure: np.random.Generator
) -> Scenario:
    """Draws the scenario of a talk task."""
    names = _name_streets(town, streets)
    task = draw_talk_task(town, names, family, seed)
    storyboard = storyboard_of(task)
    taken = {landmark.site for landmark in storyboard.landmarks}
    free = [site for site in connected_sites(town) if site.id not in taken] or list(connected_sites(town))
    start = free[int(departure.integers(len(free)))]
    return Scenario(
        seed=seed,
        storyboard=storyboard,
        street_names=names,
        departure=task.departure or (start.lane, start.station),
        street_titles=_titles(town),
    )


_ATTEMPTS: Final = 20  # generated storyboards of each number of stops that are tried in a town with few places


def _generated_template(town: Town, stops: tuple[int, int], rng: np.random.Generator) -> StoryboardTemplate:
    """Draws a generated storyboard with a number of stops in a range: in a town with few places, with fewer.

    Raises:
        StoryboardError: no storyboard of that many stops is as small as the town.
    """
    low, high = max(stops[0], STOPS[0]), min(stops[1], STOPS[1])
    if low > high:
        reason = f"have {STOPS[0]} to {STOPS[1]} stops, not {stops[0]} to {stops[1]}; change EnvConfig.stops"
        raise StoryboardError("generated", "subgoals", reason)
    places, seed = len(connected_sites(town)), int(rng.integers(MOST_SEED))
    for number in range(int(rng.integers(low, high + 1)), low - 1, -1):
        for attempt in range(_ATTEMPTS):
            named = StoryboardSpecification(seed=(seed + attempt) % MOST_SEED, stops=number)
            template = tasks.load_template(str(named))
            if tasks.needed_places(template) <= places:
                return template
    reason = f"with {low} stops need more than the {places} places of town {town.name}; use a larger town"
    raise StoryboardError("generated", "landmarks", reason)


def fitting_templates(town: Town) -> list[StoryboardTemplate]:
    """Returns the shipped storyboards for whose landmarks a town has places.

    Raises:
        StoryboardError: there is none; the message has the numbers.
    """
    templates = [tasks.load_template(name) for name in tasks.template_names()]
    fitting = [template for template in templates if tasks.needed_places(template) <= len(connected_sites(town))]
    if not fitting:
        least = min(templates, key=tasks.needed_places)
        reason = (
            f"needs {tasks.needed_places(least)} places, fewer than any other, but town {town.name} has"
            f" {len(connected_sites(town))} that cars can reach and leave again; use a larger town with connected roads"
        )
        raise StoryboardError(least.name, "landmarks", reason)
    return fitting


def _with_stops(
    templates: Sequence[StoryboardTemplate], stops: tuple[int, int], town: Town
) -> list[StoryboardTemplate]:
    """Returns the templates with a number of stops in a range; raises `StoryboardError` if there is none."""
    found = [
        template
        for template in templates
        if stops[0] <= sum(not subgoal.trigger for subgoal in template.subgoals) <= stops[1]
    ]
    if not found:
        reason = (
            f"no shipped storyboard that fits town {town.name} has {stops[0]} to {stops[1]} stops; use a larger town"
        )
        raise StoryboardError(templates[0].name, "subgoals", reason)
    return found


def _name_streets(town: Town, rng: np.random.Generator) -> tuple[StreetName, ...]:
    """Returns shuffled names; a street named Highway keeps its name, streets beyond the fourteenth have no name.

    In a town with titles, the longest streets with titles are named first; a title with a name of the vocabulary in it,
    such as "N Broadway", gets this one.
    """
    shuffled: list[StreetName] = [STREET_NAMES[int(i)] for i in rng.permutation(len(STREET_NAMES))]
    if any(town.street_titles):
        return _name_titled(town, shuffled)
    names: list[StreetName] = []
    for street in town.streets:
        if street.name == StreetName.HIGHWAY.label:
            names.append(StreetName.HIGHWAY)
        else:
            names.append(shuffled.pop() if shuffled else StreetName.UNKNOWN)
    return tuple(names)


def _name_titled(town: Town, shuffled: list[StreetName]) -> tuple[StreetName, ...]:
    titles = town.street_titles
    length = [sum(town.lanes[lane].length for lane in street.lanes) for street in town.streets]
    order = sorted(range(len(titles)), key=lambda k: (not titles[k], -length[k], k))
    found: dict[int, StreetName] = {}
    for k in order:
        words = re.findall(r"\w+", titles[k].lower())
        same = next((name for name in shuffled if name.label.lower() in words), None)
        if same is not None:
            found[k] = same
            shuffled.remove(same)
    for k in order:
        if k not in found and shuffled:
            found[k] = shuffled.pop()
    return tuple(found.get(k, StreetName.UNKNOWN) for k in range(len(titles)))


def _titles(town: Town) -> tuple[str, ...]:
    """Returns the titles of the streets of a town; empty if none has one."""
    return town.street_titles if any(town.street_titles) else ()


def session_seeds(scenario: Scenario) -> list[np.random.SeedSequence]:
    """Returns the seeds of a session: of the world, of words, of the recogniser, of styles, and of voices."""
    # A new subsystem takes a further child at the end: the seeds of the others stay as they are.
    return np.random.SeedSequence([scenario.seed, 1]).spawn(5)


def world_seed_of(scenario: Scenario) -> np.random.SeedSequence:
    """Returns the first of the seeds of a session, that of the world, without the others."""
    return np.random.SeedSequence([scenario.seed, 1], spawn_key=(0,))


def header_of(scenario: Scenario, town: str, config: EnvConfig) -> SessionHeader:
    """Returns the header of a session's record.

    Args:
        scenario: scenario of the session.
        town: name of the town.
        config: settings of the session.
    """
    storyboard = scenario.storyboard
    return SessionHeader(
        town=town,
        storyboard=storyboard.name,
        seed=scenario.seed,
        decision_frequency=config.decision_frequency,
        street_names=[name.label for name in scenario.street_names],
        landmarks=[
            {
                "name": landmark.name.label,
                "lane": landmark.lane,
                "station": landmark.station,
                "x": landmark.position[0],
                "y": landmark.position[1],
                "street": landmark.street,
                "hidden": landmark.hidden,
            }
            for landmark in storyboard.landmarks
        ],
        subgoals=[_row_of(subgoal) for subgoal in storyboard.subgoals],
        story=storyboard.story,
        departure=scenario.departure,
        config=config.record(),
        extra=_extra_of(scenario),
    )


def _extra_of(scenario: Scenario) -> dict[str, object]:
    reference = {} if scenario.reference is None else {REFERENCE: scenario.reference.to_json()}
    return {**reference, **({STREET_TITLES: list(scenario.street_titles)} if scenario.street_titles else {})}


def _row_of(subgoal: Subgoal) -> SubgoalRow:
    row = SubgoalRow(
        description=subgoal.description,
        landmark=subgoal.landmark,
        after=subgoal.after,
        trigger=subgoal.trigger,
        delete=subgoal.delete,
        change=subgoal.change,
    )
    if subgoal.reason is not None:
        row["extra"] = {"reason": subgoal.reason}
    return row
