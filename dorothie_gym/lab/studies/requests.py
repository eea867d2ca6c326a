"""Bodies of the requests of participants' browsers: a closed set of types with checked fields."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from msgspec import Meta, Struct

from dorothie_gym.lab.studies.items import MAX_TEXT
from dorothie_gym.lab.studies.stages import Stage
from dorothie_gym.ontology.roles import Role


class Body(Struct, forbid_unknown_fields=True, frozen=True):
    """Body of a request."""


_Name: TypeAlias = Annotated[str, Meta(max_length=40)]
_Parameter: TypeAlias = Annotated[str, Meta(max_length=200)]
_Value: TypeAlias = Annotated[str, Meta(max_length=2000)]
_Option: TypeAlias = Annotated[str, Meta(max_length=200)]
_Text: TypeAlias = Annotated[str, Meta(max_length=MAX_TEXT)]


class Join(Body, frozen=True):
    """Entry: parameters of the link, token of an invitation or readmission, and a random text of the tab."""

    parameters: Annotated[dict[_Parameter, _Value], Meta(max_length=200)] = {}
    invitation: Annotated[str, Meta(max_length=64)] | None = None
    visit: Annotated[str, Meta(min_length=20, max_length=64)] | None = None


class News(Body, frozen=True):
    """Request for the view as soon as it differs from the one with the tag `have`."""

    have: Annotated[str, Meta(max_length=64)] = ""


class Consent(Body, frozen=True):
    """Consent: the accepted statements; None declines."""

    agreed: Annotated[list[bool], Meta(max_length=20)] | None


class Answers(Body, frozen=True):
    """Answers to the questionnaire of a stage, by item."""

    stage: Stage
    answers: Annotated[dict[_Name, _Text | int | float | list[_Option] | None], Meta(max_length=200)]


class Proceed(Body, frozen=True):
    """Wish to end a stage; `role` is the one whose instructions were read."""

    stage: Stage
    role: Role | None = None


class Wait(Body, frozen=True):
    """Choice of a person for whom no partner was found: to continue waiting, or to finish."""

    on: bool


class Enter(Body, frozen=True):
    """Entry of the experimenter: the token of the link."""

    token: Annotated[str, Meta(max_length=64)]


class Readmit(Body, frozen=True):
    """Wish of the experimenter for a link for a person: number, or id of the recruiting platform."""

    participant: Annotated[str, Meta(min_length=1, max_length=2000)]


class Overview(Body, frozen=True):
    """Request of the experimenter for the state of the study."""


class Withdraw(Body, frozen=True):
    """Withdrawal, which the person must have confirmed."""

    sure: bool
