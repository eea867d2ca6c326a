"""Data for the browser of a participant at each stage: texts, questions, and the token of the participant's seat.

It holds nothing about conditions, other people or the assignment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import msgspec

from dorothie_gym.lab.console.config import AfterAbsence
from dorothie_gym.lab.studies.stages import QUESTIONNAIRES, Outcome, Stage

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.progress import Progress
    from dorothie_gym.lab.studies.record_types import Participant
    from dorothie_gym.lab.studies.study import Study


def entrance_view(progress: Progress) -> dict[str, Any]:
    """Returns the public data of the study: the title."""
    return {"title": progress.study.title}


def participant_view(progress: Progress, person: Participant) -> dict[str, Any]:
    """Returns the view of a participant in JSON types; equal states give equal views.

    May open the room in which the participant has a seat.
    """
    study, stage = progress.study, person.stage
    view: dict[str, Any] = {"title": study.title, "contact": study.contact, "stage": stage.value, "id": person.id}
    if stage is Stage.CONSENT:
        view |= {"text": study.consent.text, "statements": study.statements}
    elif stage in QUESTIONNAIRES:
        view["items"] = msgspec.to_builtins(study.questionnaire(QUESTIONNAIRES[stage]))
        view["part"] = person.position
    elif stage is Stage.INSTRUCTIONS and person.role is not None:
        view |= {"text": study.texts.instructions.of(person.role), "part": person.role.value}
    elif stage is Stage.TUTORIAL and person.role is not None:
        view |= {"text": study.texts.tutorial.of(person.role), "token": progress.seat_token(person)}
    elif stage is Stage.LOBBY:
        in_vain = progress.waiting.has_waited_in_vain(person.id)
        view |= {"text": study.texts.no_partner if in_vain else study.texts.waiting, "in_vain": in_vain}
    elif stage is Stage.SESSION:
        token, row = progress.seat_token(person), progress.session_of(person)
        view |= {"token": token, "over": row is not None and row.reason is not None, "away": _absence(study)}
    elif stage is Stage.DEBRIEFING:
        view["text"] = study.texts.debriefing
    elif stage is Stage.DONE:
        in_vain = person.outcome is Outcome.NO_PARTNER
        end = study.recruitment.no_partner if in_vain else study.recruitment.completion
        view |= {"code": end.code, "url": end.url}
    return view


def _absence(study: Study) -> dict[str, str]:
    """Returns what happens next while others are away, and while the person's browser has no connection."""
    seconds, kind = f"{study.absence.seconds:.0f} s", study.absence.then
    if kind is AfterAbsence.END:
        others = f"After {seconds} the session ends; you then go on with the study and get your code."
        lost = f"If it takes longer than {seconds}, the session ends; you can then still go on here."
    elif kind is AfterAbsence.SCRIPT:
        others = f"After {seconds} a computer program takes the place, and the session goes on."
        lost = f"After {seconds} a computer program takes your place until you are back."
    else:
        others = "The session goes on as soon as everybody is back. You can withdraw at any time."
        lost = "The session waits for you."
    return {"others": others, "lost": f"There is no connection. This page tries again by itself. {lost}"}
