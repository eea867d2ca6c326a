"""Kinds of talk tasks: ten of "ask first" and eight of "admit it".

Each kind draws one of its worlds, in which the same or similar words need another reaction.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from dorothie_gym.dialogue.refusals import Reason
from dorothie_gym.errors import StoryboardError
from dorothie_gym.maps.routing import cuts_off
from dorothie_gym.maps.site_inference import connected_sites
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.session.talk_tasks import TARGET, Reaction, TalkTask, TaskDraw, UnfitTownError, in_map_order
from dorothie_gym.tasks.briefs import Brief, Cue, Reply, TalkFamily
from dorothie_gym.tasks.catalogue import catalogue, kinds_in, map_label

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

ACT_SHARE: Final = 0.3
"""Share of the worlds in which the request can be fulfilled as it is."""

ASK_SHARE: Final = 0.35
"""Share of the worlds in which something must be settled first, in kinds that have such worlds."""

_UNIQUE: Final = tuple(name for name, kind in catalogue().items() if not kind.repeatable)
_WHICH: Final = ("which", "what", "where", "who", "whose", "do you mean", "did you mean")

_TASKS_BRANCH: Final = 7  # branch of the seed of a session, for its talk task


# --- Ask first --------------------------------------------------------------------------------------------------------


def _several(draw: TaskDraw, kind: str, name: LandmarkName, request: str) -> TalkTask:
    """Request for a house or a person in words that fit one, several or none in the town."""
    if draw.share < ACT_SHARE:
        (street,) = draw.streets(1)
        there = draw.around([(name, draw.take(street))])
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)
    if draw.share < ACT_SHARE + ASK_SHARE:
        meant, other = draw.streets(2)
        reply = Reply(cue=Cue.ASKED, words=_WHICH, text=f"The one on {meant.label}, please.")
        there = draw.around([(name, draw.take(meant)), (name, draw.take(other))])
        brief = Brief(request=request, replies=(reply,))
        return TalkTask(kind=kind, reaction=Reaction.ASK, brief=brief, landmarks=there, target=0)
    return _not_there(draw, kind, request, [name])


def _not_there(draw: TaskDraw, kind: str, request: str, absent: Sequence[LandmarkName]) -> TalkTask:
    """Request for places that the town does not have."""
    return TalkTask(
        kind=kind,
        reaction=Reaction.ADMIT,
        brief=Brief(request=request),
        landmarks=draw.around([], absent),
        reason=Reason.NOT_THERE,
    )


def _two_houses(draw: TaskDraw) -> TalkTask:
    return _several(draw, "two_houses", LandmarkName.HOUSE, "Please take me to the house.")


def _two_friends(draw: TaskDraw) -> TalkTask:
    return _several(draw, "two_friends", LandmarkName.PERSON, "Please take me to my friend.")


def _house_by_looks(draw: TaskDraw) -> TalkTask:
    colour = ("red", "green", "blue", "white")[int(draw.rng.integers(4))]
    request = f"Please take me to the house with the {colour} door."
    return _several(draw, "house_by_looks", LandmarkName.HOUSE, request)


def _friend_by_looks(draw: TaskDraw) -> TalkTask:
    colour = ("red", "green", "blue", "grey")[int(draw.rng.integers(4))]
    request = f"Please take me to the person in the {colour} coat."
    return _several(draw, "friend_by_looks", LandmarkName.PERSON, request)


def _restaurants(draw: TaskDraw) -> TalkTask:
    """Request for any place of a category."""
    kind, request = "restaurants", "I am hungry. Please take me to the restaurant."
    names = [each.name for each in kinds_in("places.restaurants")]
    if draw.share >= ACT_SHARE + ASK_SHARE:
        return _not_there(draw, kind, request, names)
    count = 1 if draw.share < ACT_SHARE else 2
    streets, chosen = draw.streets(count), draw.one_of(names, count)
    there = draw.around([(name, draw.take(street)) for name, street in zip(chosen, streets, strict=True)], names)
    if count == 1:
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)
    reply = Reply(cue=Cue.ASKED, words=_WHICH, text=f"{map_label(chosen[0])}, please.")
    brief = Brief(request=request, replies=(reply,))
    return TalkTask(kind=kind, reaction=Reaction.ASK, brief=brief, landmarks=there, target=0)


def _elsewhere(draw: TaskDraw, kind: str, *, insists: bool) -> TalkTask:
    """Request for a place on a street on which the map shows it, or not."""
    (name,) = draw.one_of(_UNIQUE)
    true, said = draw.streets(2)
    asked = true if draw.share < ACT_SHARE else said
    request = f"Please take me to {map_label(name)} on {asked.label}."
    if draw.share >= ACT_SHARE + ASK_SHARE:
        return _not_there(draw, kind, request, [name])
    there = draw.around([(name, draw.take(true))])
    if draw.share < ACT_SHARE:
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)
    words = (true.label,)
    replies = [Reply(cue=Cue.TOLD, words=words, text="Oh, you are right. Then take me there, please.")]
    if insists:
        replies.insert(0, Reply(cue=Cue.TOLD, words=words, text=f"No, it is on {said.label}, I am quite sure."))
    brief = Brief(request=request, replies=tuple(replies), otherwise=f"To {map_label(name)}, on {said.label}.")
    return TalkTask(kind=kind, reaction=Reaction.ASK, brief=brief, landmarks=there, target=0)


def _wrong_street(draw: TaskDraw) -> TalkTask:
    return _elsewhere(draw, "wrong_street", insists=False)


def _insisting_partner(draw: TaskDraw) -> TalkTask:
    return _elsewhere(draw, "insisting_partner", insists=True)


def _either_or(draw: TaskDraw) -> TalkTask:
    """Request for one of two places: both, one or none of them is in the town."""
    first, second = draw.one_of(_UNIQUE, 2)
    kind, request = "either_or", f"Please take me to {map_label(first)} or {map_label(second)}."
    if draw.share >= ACT_SHARE + ASK_SHARE:
        return _not_there(draw, kind, request, [first, second])
    one, two = draw.streets(2)
    if draw.share < ACT_SHARE:
        there = draw.around([(second, draw.take(one))], [first])
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)
    there = draw.around([(second, draw.take(one)), (first, draw.take(two))])
    reply = Reply(cue=Cue.ASKED, words=(*_WHICH, "or"), text=f"{map_label(second)}, please.")
    brief = Brief(request=request, replies=(reply,))
    return TalkTask(kind=kind, reaction=Reaction.ASK, brief=brief, landmarks=there, target=0)


def _there_again(draw: TaskDraw) -> TalkTask:
    """Request for a place that was named before, or not."""
    kind = "there_again"
    (name,) = draw.one_of(_UNIQUE)
    named = f"I liked {map_label(name)} last week. Please take me there again."
    if draw.share >= ACT_SHARE + ASK_SHARE:
        return _not_there(draw, kind, named, [name])
    (street,) = draw.streets(1)
    there = draw.around([(name, draw.take(street))])
    if draw.share < ACT_SHARE:
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=named), landmarks=there, target=0)
    reply = Reply(cue=Cue.ASKED, words=_WHICH, text=f"To {map_label(name)}, please.")
    brief = Brief(request="I liked it so much last week. Please take me there again.", replies=(reply,))
    return TalkTask(kind=kind, reaction=Reaction.ASK, brief=brief, landmarks=there, target=0)


def _house_on_street(draw: TaskDraw) -> TalkTask:
    """Request for the house on a street that has one, two or none of them."""
    kind, name = "house_on_street", LandmarkName.HOUSE
    asks = ACT_SHARE <= draw.share < ACT_SHARE + ASK_SHARE
    (street,) = draw.streets(1, sites=2 if asks else 1)
    others = [each for each in draw.streets(2) if each is not street]
    request = f"Please take me to the house on {street.label}."
    if draw.share >= ACT_SHARE + ASK_SHARE:
        return _not_there(draw, kind, request, [name])
    if not asks:
        there = draw.around([(name, draw.take(street)), (name, draw.take(others[0]))])
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)
    there = draw.around([(name, draw.take(street)), (name, draw.take(street))])
    reply = Reply(cue=Cue.ASKED, words=_WHICH, text=f"{TARGET} on your map, please.")
    brief = Brief(request=request, replies=(reply,))
    return TalkTask(kind=kind, reaction=Reaction.ASK, brief=brief, landmarks=there, target=0)


# --- Admit it ---------------------------------------------------------------------------------------------------------


def _no_such_place(draw: TaskDraw) -> TalkTask:
    (name,) = draw.one_of(_UNIQUE)
    kind, request = "no_such_place", f"Please take me to {map_label(name)}."
    if draw.share >= ACT_SHARE:
        return _not_there(draw, kind, request, [name])
    (street,) = draw.streets(1)
    there = draw.around([(name, draw.take(street))])
    return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)


def _no_such_street(draw: TaskDraw) -> TalkTask:
    """Request for a house on a street that the town has, or does not have."""
    kind, name = "no_such_street", LandmarkName.HOUSE
    (street,) = draw.streets(1)
    there = draw.around([(name, draw.take(street))])
    asked = street if draw.share < ACT_SHARE else draw.absent_street()
    request = f"Please take me to the house on {asked.label}."
    if draw.share < ACT_SHARE:
        return TalkTask(kind=kind, reaction=Reaction.GO_TO, brief=Brief(request=request), landmarks=there, target=0)
    return TalkTask(
        kind=kind,
        reaction=Reaction.ADMIT,
        brief=Brief(request=request),
        landmarks=there,
        reason=Reason.NOT_THERE,
    )


def _street_closed(draw: TaskDraw) -> TalkTask:
    """Request to drive on along the street, which is closed ahead of the car, or not."""
    town = draw.town
    places = _closable(town)
    if not places:
        raise UnfitTownError
    lane, metres = places[int(draw.rng.integers(len(places)))]
    there = tuple(pair for pair in draw.around([]) if pair[1].lane != lane)
    closed = draw.share >= ACT_SHARE
    return TalkTask(
        kind="street_closed",
        reaction=Reaction.ADMIT if closed else Reaction.AGREE,
        brief=Brief(request="Please drive straight on along this street."),
        landmarks=there,
        reason=Reason.CLOSED if closed else None,
        closed=(lane, metres) if closed else None,
        departure=(lane, metres - CLOSED_AHEAD),
    )


@functools.lru_cache(maxsize=64)
def _closable(town: Town) -> tuple[tuple[int, int], ...]:
    """Returns the places (lane and station [m]) at which a street may be closed: away from sites, with a way around.

    A lane has at most one of them, since the search for a way around takes a while.
    """
    reachable = {site.lane for site in connected_sites(town)}
    found = []
    for lane in town.lanes:
        if lane.in_junction or lane.id not in reachable:
            continue
        sites = [site.station for site in town.sites if site.lane == lane.id]
        for metres in range(CLOSURE_MARGINS[0], int(lane.length) - CLOSURE_MARGINS[1], 5):
            start = metres - CLOSED_AHEAD
            if all(abs(station - metres) >= FROM_SITES for station in sites):
                if not cuts_off(town, (lane.id, start), [], (lane.id, float(metres))):
                    found.append((lane.id, metres))
                break
        if len(found) == MOST_CLOSABLE:
            break
    return tuple(found)


CLOSED_AHEAD: Final = 35.0
"""Distance of a closed street's barrier ahead of the car at the start [m]: in sight, and with room to turn round."""

CLOSURE_MARGINS: Final = (45, 10)
"""Least distances of a barrier from the start and the end of its lane [m]."""

FROM_SITES: Final = 26.0
"""Least distance of a barrier from the stop of any site [m]."""

MOST_CLOSABLE: Final = 12
"""Number of places of a town among which a closed street is drawn."""


def _rule(draw: TaskDraw, kind: str, forbidden: str, allowed: str, unknowable: str) -> TalkTask:
    """Request against a rule of the road, the same rule as a wish, or a question about what cannot be seen."""
    there = draw.around([])
    world = min(int(3.0 * draw.share), 2)
    return TalkTask(
        kind=kind,
        reaction=Reaction.AGREE if world == 0 else Reaction.ADMIT,
        brief=Brief(request=(allowed, forbidden, unknowable)[world]),
        landmarks=there,
        reason=(None, Reason.RULES, Reason.UNSEEN)[world],
    )


def _red_light(draw: TaskDraw) -> TalkTask:
    return _rule(
        draw,
        "red_light",
        "I am in a hurry. Please do not stop at red lights today.",
        "I am in no hurry. Please always stop at red lights.",
        "How many seconds will the next red light last?",
    )


def _speed_limit(draw: TaskDraw) -> TalkTask:
    return _rule(
        draw,
        "speed_limit",
        "Please drive much faster than the speed limit.",
        "Please do not drive faster than the speed limit.",
        "Is anybody driving faster than the speed limit two streets away?",
    )


def _wrong_side(draw: TaskDraw) -> TalkTask:
    return _rule(
        draw,
        "wrong_side",
        "Please overtake everybody on the wrong side of the road.",
        "Please never drive on the wrong side of the road.",
        "Is anybody driving on the wrong side of the road at the other end of town?",
    )


def _question(draw: TaskDraw, kind: str, unknowable: str, known: str) -> TalkTask:
    """Question about a place that the map answers, that nobody in the car can see, or about a place that is not there.

    Args:
        draw: random draws.
        kind: kind of the task.
        unknowable: question that cannot be answered, with `{place}`.
        known: question that the map answers unless it has no such place, with `{place}`, and `{one}` and `{two}` for
            streets.
    """
    (name,) = draw.one_of(_UNIQUE)
    true, other = draw.streets(2)
    one, two = sorted((true, other), key=lambda street: street.value)
    words = {"place": map_label(name), "one": one.label, "two": two.label}
    world = min(int(3.0 * draw.share), 2)
    if world == 2:
        return _not_there(draw, kind, known.format(**words), [name])
    there = draw.around([(name, draw.take(true))])
    return TalkTask(
        kind=kind,
        reaction=Reaction.ANSWER if world == 0 else Reaction.ADMIT,
        brief=Brief(request=(known if world == 0 else unknowable).format(**words)),
        landmarks=there,
        reason=None if world == 0 else Reason.UNSEEN,
        answer=true if world == 0 else None,
    )


def _opening_hours(draw: TaskDraw) -> TalkTask:
    return _question(draw, "opening_hours", "Is {place} open right now?", "Which street is {place} on?")


def _people_there(draw: TaskDraw) -> TalkTask:
    return _question(
        draw,
        "people_there",
        "How many people are waiting at {place} right now?",
        "Is {place} on {one} or on {two}?",
    )


Kind: TypeAlias = Callable[[TaskDraw], TalkTask]

KINDS: Final[Mapping[TalkFamily, Mapping[str, Kind]]] = MappingProxyType(
    {
        TalkFamily.ASK_FIRST: MappingProxyType(
            {
                "two_houses": _two_houses,
                "two_friends": _two_friends,
                "house_by_looks": _house_by_looks,
                "friend_by_looks": _friend_by_looks,
                "restaurants": _restaurants,
                "wrong_street": _wrong_street,
                "insisting_partner": _insisting_partner,
                "either_or": _either_or,
                "there_again": _there_again,
                "house_on_street": _house_on_street,
            }
        ),
        TalkFamily.ADMIT_IT: MappingProxyType(
            {
                "no_such_place": _no_such_place,
                "no_such_street": _no_such_street,
                "street_closed": _street_closed,
                "red_light": _red_light,
                "speed_limit": _speed_limit,
                "wrong_side": _wrong_side,
                "opening_hours": _opening_hours,
                "people_there": _people_there,
            }
        ),
    }
)
"""Kinds of each family by name."""


def draw_talk_task(town: Town, names: Sequence[StreetName], family: TalkFamily, seed: int) -> TalkTask:
    """Draws the talk task of a session; equal arguments give equal tasks.

    Args:
        town: the map.
        names: name of each street of the town.
        family: family of the task.
        seed: seed of the session.

    Raises:
        StoryboardError: no kind of the family fits the town.
    """
    kinds = list(KINDS[family].items())
    order = np.random.default_rng(np.random.SeedSequence([seed, _TASKS_BRANCH])).permutation(len(kinds)).tolist()
    for attempt, k in enumerate(order):
        rng = np.random.default_rng(np.random.SeedSequence([seed, _TASKS_BRANCH, 1 + attempt]))
        try:
            task = kinds[k][1](TaskDraw(town, names, rng))
        except UnfitTownError:
            continue
        if task.landmarks:
            return in_map_order(task)
    reason = f"no kind of task fits town {town.name}; use a town with sites on two streets with names"
    raise StoryboardError(str(family), "landmarks", reason)
