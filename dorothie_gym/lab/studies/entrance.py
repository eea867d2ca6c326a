"""Entrance of a study: links, invitations, ids of the recruiting platform, and readmission after a lost cookie."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from dorothie_gym.lab.studies.stages import RefusedError
from dorothie_gym.lab.studies.study import Admission, Study

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.records import StudyRecords

_PLACEHOLDER: Final = re.compile(r"[{}<>\[\]%$]")
"""Signs of templates, such as {{%PROLIFIC_PID%}}, ${e://Field/id}, [ID] or <id>; ids of platforms have none of them."""

_NO_VALUES: Final = frozenset(("null", "undefined", "none", "assignment_id_not_available"))
"""Values, in lower case, that programs write if they have no id; the last one is of MTurk's preview."""


def is_placeholder(name: str, value: str) -> bool:
    """Returns whether the value of a link's parameter was never filled in, so that it identifies no person."""
    plain = value.strip().lower()
    return not plain or plain == name.lower() or plain in _NO_VALUES or _PLACEHOLDER.search(value) is not None


class Entrance:
    """Entrance of a study.

    Args:
        study: the study.
        records: records of the study.
    """

    def __init__(self, study: Study, records: StudyRecords) -> None:
        self._study, self._records = study, records
        self._key = next(iter(study.recruitment.parameters), None)

    def join(self, parameters: Mapping[str, str], token: str | None, visit: str | None) -> tuple[str, str]:
        """Adds a person, or readmits one; returns the id and the secret of the browser.

        Args:
            parameters: parameters of the link; unknown names and placeholders are left out.
            token: token of an invitation, or of a link for readmission; None for neither.
            visit: random text of the browser's tab. If an answer is lost in transit, the same tab gets the same place.

        Raises:
            RefusedError: the person already takes part, or the link lacks a parameter that the study needs.
        """
        records, kept, contact = self._records, self._kept(parameters), self._study.contact
        with records.transaction():
            back = None if token is None else records.use_readmission(token, visit)
            if back is None and visit is not None:
                back = records.find_visit(visit)
            if back is not None:
                return back, records.renew_secret(back)
        if self._person(kept) is not None:
            raise RefusedError(
                "You take part in this study already. Please go on in the browser in which you began. If you cannot, "
                f"ask for a link that lets you go on here: {contact}"
            )
        if self._study.recruitment.required and self._key not in kept:
            raise RefusedError(
                "Please open the study by the link that your recruiting platform shows you: this address lacks the "
                f"number by which you are paid. Contact: {contact}"
            )
        invited = self._study.recruitment.admission is Admission.INVITED
        if (token is None and invited) or (token is not None and not (invited and records.is_unused(token))):
            raise RefusedError(f"This link is not valid, or it has been used. Please ask for a new one: {contact}")
        return records.add_participant(kept, invitation=token if invited else None, visit=visit)

    def _kept(self, parameters: Mapping[str, str]) -> dict[str, str]:
        given = {name: parameters.get(name, "") for name in self._study.recruitment.parameters}
        return {name: value for name, value in given.items() if not is_placeholder(name, value)}

    def _person(self, kept: Mapping[str, str]) -> str | None:
        """Returns the id of the participant with the platform's id of a link; None if there is none."""
        if self._key is None or self._key not in kept:
            return None
        return self._records.find_platform_id(self._key, kept[self._key])

    def is_other_person(self, name: str, parameters: Mapping[str, str], token: str | None) -> bool:
        """Returns whether a link was given to another person than the one who used this browser before."""
        if token is not None and (self._records.is_unused(token) or self._records.is_unused_readmission(token)):
            return True
        kept = self._kept(parameters)
        return self._key in kept and self._person(kept) != name

    def readmit(self, given: str) -> str | None:
        """Returns the token of a link with which a person continues in another browser; None for an unknown person.

        The link admits one tab. The old browser works until then; an older link becomes invalid immediately.

        Args:
            given: id of the participant, or of the recruiting platform.
        """
        name = self._records.find_person(given, self._key)
        return None if name is None else self._records.readmit(name)
