"""Remarks of the learned Co-Wizard: those of the corpus without their names, and where it takes the names from.

Forms are explained in `learned_role.remark_forms`. Answers of the rules and repetitions are taken as a whole.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.co_wizard.answers import answer_to, is_answer, said_again
from dorothie_gym.baselines.roles.learned_role import remark_forms
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.proposition_truth import seconds_to_goal
from dorothie_gym.policies.observation_parser import nearest_landmark, street_of
from dorothie_gym.policies.route_progress import direction_of, first_new_street
from dorothie_gym.policies.speech import Remark
from dorothie_gym.policies.view_range import sight, suitable_speed

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.co_wizard.memory import WorkingMemory
    from dorothie_gym.baselines.roles.learned_role.remark_forms import Sources
    from dorothie_gym.baselines.roles.learned_role.utterance_inputs import Utterance
    from dorothie_gym.policies.co_wizard.view import CoWizardView

_WHOLES: Final = ("answer", "again")
"""Sources of whole remarks: the answer to the last question, and a repetition of the last remark."""


def sources(memory: WorkingMemory, view: CoWizardView, utterances: Sequence[Utterance]) -> dict[str, object]:
    """Returns the names and numbers that can be said now, by source; the preferred ones first."""
    town, latest = memory.town, utterances[0] if utterances else None
    wholes = {"answer": answer_to(latest, memory, view), "again": said_again(latest, memory)}
    mark = next((mark for mark in view.landmarks if mark.row == memory.goal_mark), None)
    progress = memory.navigator.route.progress
    found: dict[str, object] = {**wholes, "goal": memory.goal}
    if latest is not None and view.time - latest.time < 8.0:
        found |= {f"place{k}": name for k, name in enumerate(latest.places[:2])}
        found |= {f"street{k}": name for k, name in enumerate(latest.streets[:2])}
        speed = latest.heard.words.speed
        found |= {} if speed is None else {"said_speed": round(speed)}
    found["former"] = memory.former
    found["goal_street"] = None if mark is None else mark.street
    for place in found.get("place0"), found.get("place1"):
        alike = [one for one in view.landmarks if one.name is place]
        if alike:
            found.setdefault("place_street", alike[0].street)
    found["here"] = street_of(view.raw, town, view.lane)
    if progress is not None:
        crossings = [crossing for _, crossing in zip(range(6), progress.crossings(town, view.station), strict=False)]
        turns = [one for one in crossings if one.direction in (Direction.LEFT, Direction.RIGHT)]
        found |= {f"turn{k}": street_of(view.raw, town, one.exit.lane) for k, one in enumerate(turns[:2])}
        found["new_street"] = first_new_street(view.raw, town, view.lane, progress)
        found["seconds"] = seconds_to_goal(memory.knowledge, view)
    for way in () if view.choice is None else view.choice.exits:
        found.setdefault(f"to_{direction_of(way)}", street_of(view.raw, town, way.lane))
    near = nearest_landmark(view.raw, view.landmarks, *view.position)
    found["near"] = None if near is None else near.name
    pace = suitable_speed(sight(view.raw))
    found |= {"suitable": pace, "slow": pace - 5, "sight": 10 * round(sight(view.raw) / 10.0)}
    if memory.standstill.since is not None:
        found["since"] = round(memory.standstill.since)
    unnamed = (None, StreetName.UNKNOWN, LandmarkName.UNKNOWN)
    return {name: value for name, value in found.items() if value not in unnamed}


def form_of(remark: Remark, available: Sources) -> str | None:
    """Returns the form of a remark, a whole one if rules produce it; None if a part of it has no source."""
    answer, again = (available.get(name) for name in _WHOLES)
    if isinstance(again, Remark) and (remark.act, remark.meaning) == (again.act, again.meaning):
        return _whole_form("again")
    if isinstance(answer, Remark) and is_answer(remark, answer):
        return _whole_form("answer")
    return remark_forms.form_of(remark, available)


def _whole_form(source: str) -> str:
    return json.dumps({"whole": ["from", source]}, separators=(",", ":"))


def check_form(form: str) -> None:
    """Raises `ValueError`, `LookupError` or `TypeError` if a text from a file is not a form of a remark."""
    remark_forms.check_form(form, remark_forms.sources_of(form), remark_forms.filled, _example)


def _example(source: str) -> object:
    """Returns the possible values of a source."""
    if source in _WHOLES:
        return Remark(act=DialogueAct.of(DialogueMove.REPLY_U))
    if source in ("goal", "former", "near", "place0", "place1"):
        return LandmarkName.KFC
    numbers = ("seconds", "said_speed", "suitable", "slow", "sight", "since")
    return 30 if source in numbers else StreetName.BEAL
