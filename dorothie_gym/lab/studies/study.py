"""Study: conditions, assignment, texts, questionnaires, recruitment, and rules for waiting and leaving."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Annotated, TypeAlias

from msgspec import Meta, Struct, field

from dorothie_gym.lab.console.config import AfterAbsence, WhileAway
from dorothie_gym.lab.studies.items import Identifier, Item, Label
from dorothie_gym.ontology.roles import AGENT_ROLES, Role

Prose: TypeAlias = Annotated[str, Meta(min_length=1, max_length=20_000)]
"""Text in paragraphs; lines that begin with "# " are headings, with "- " items of a list."""

HUMAN = "human"
"""Player of a role that a person plays."""


class Admission(enum.StrEnum):
    """People who may take part."""

    OPEN = "open"
    """Admission of every person with the link."""
    INVITED = "invited"
    """People with an invitation, which holds a token that can be used once."""


class Method(enum.StrEnum):
    """Method that assigns conditions to groups of people."""

    BLOCKS = "block_randomisation"
    """Each group plays one condition; each block has every condition once, in random order."""
    LATIN_SQUARE = "balanced_latin_square"
    """Each group plays every condition; each block has every row of a balanced Latin square once, in random order."""


class _Part(Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Part of a study file."""


class Scenario(_Part, frozen=True, kw_only=True):
    """Town and storyboard of sessions, by name or file; without a storyboard, the seed draws one."""

    town: Label
    storyboard: Label | None = None


class Condition(_Part, frozen=True, kw_only=True):
    """Condition of the study.

    Attributes:
        name: name in exports.
        participant: "human", or a policy by name or file.
        co_wizard: see `participant`.
        ad_wizard: see `participant`.
        word_error_rate: word error rate between participant and Co-Wizard.
    """

    name: Identifier
    participant: Label = HUMAN
    co_wizard: Label = "scripted"
    ad_wizard: Label = "scripted"
    word_error_rate: Annotated[float, Meta(ge=0.0, le=0.95)] = 0.0

    @property
    def players(self) -> dict[Role, str]:
        """Player of each role."""
        return {role: str(getattr(self, role.value)) for role in AGENT_ROLES}

    @property
    def people(self) -> tuple[Role, ...]:
        """Roles that people play."""
        return tuple(role for role, player in self.players.items() if player == HUMAN)


class Assignment(_Part, frozen=True, kw_only=True):
    """Assignment of conditions and roles.

    Attributes:
        method: see `Method`.
        seed: seed of the order of conditions and roles, and of the sessions.
    """

    method: Method = Method.BLOCKS
    seed: Annotated[int, Meta(ge=0, le=2**31)] = 0


class SessionSettings(_Part, frozen=True, kw_only=True):
    """Settings of sessions.

    Attributes:
        max_seconds: simulated time after which a session ends [s].
        pictures: whether seats look through the windscreen.
        speech: whether people can speak into a microphone and hear the others, in addition to typing; speech is
            recorded with the session.
        tier: name of a `Tier` whose settings the sessions have, such as "rough"; see `ConsoleConfig.tier`.
    """

    max_seconds: Annotated[float, Meta(ge=5.0, le=7200.0)] = 900.0
    pictures: bool = True
    speech: bool = False
    tier: Label | None = None


class Tutorial(_Part, frozen=True, kw_only=True):
    """Drive with scripted partners before the first session; it is not recorded.

    Attributes:
        seconds: simulated time after which it ends [s]; people may end it earlier.
        scenario: town and storyboard.
    """

    seconds: Annotated[float, Meta(ge=5.0, le=3600.0)] = 120.0
    scenario: Scenario = field(default_factory=lambda: Scenario(town="brookside"))


class Absence(_Part, frozen=True, kw_only=True):
    """Rules for people who leave a session: immediate effect, waiting time, and effect after it."""

    while_away: WhileAway = WhileAway.PAUSE
    seconds: Annotated[float, Meta(ge=0.0, le=86400.0)] = 60.0
    then: AfterAbsence = AfterAbsence.END


class WaitingRoom(_Part, frozen=True, kw_only=True):
    """Waiting room.

    Attributes:
        seconds: time after which people who have no partner may finish with the code for that case [s].
    """

    seconds: Annotated[float, Meta(ge=1.0, le=86400.0)] = 300.0


class Completion(_Part, frozen=True, kw_only=True):
    """Code that people are shown at the end, and an address to continue to."""

    code: Annotated[str, Meta(min_length=1, max_length=80)] | None = None
    url: (
        Annotated[str, Meta(pattern=r"^https?://[^\s<>\"]{1,500}$", description="an address of http or https")] | None
    ) = None


class Recruitment(_Part, frozen=True, kw_only=True):
    """Recruitment of people.

    Attributes:
        admission: people who may take part.
        parameters: names of the parameters of the link that are kept; the first one identifies a person.
        required: whether people need the first parameter, by which the platform pays, to take part.
        completion: ending for people who took part.
        no_partner: ending for people for whom no partner was found.
    """

    admission: Admission = Admission.OPEN
    parameters: Annotated[list[Annotated[str, Meta(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$")]], Meta(max_length=8)] = (
        field(default_factory=lambda: ["PROLIFIC_PID", "STUDY_ID", "SESSION_ID"])
    )
    required: bool = False
    completion: Completion = field(default_factory=Completion)
    no_partner: Completion = field(default_factory=Completion)


class Consent(_Part, frozen=True, kw_only=True):
    """Information and consent: a text, and statements that must all be agreed to.

    Attributes:
        text: information.
        statements: statements to agree to.
        voice: a further statement, on the recording of voices; needed where people can speak.
    """

    text: Prose
    voice: Annotated[str, Meta(min_length=1, max_length=1000)] | None = None
    statements: Annotated[list[Annotated[str, Meta(min_length=1, max_length=1000)]], Meta(min_length=1, max_length=20)]


class RoleTexts(_Part, frozen=True, kw_only=True):
    """Text for each role that people play."""

    participant: Prose | None = None
    co_wizard: Prose | None = None
    ad_wizard: Prose | None = None

    def of(self, role: Role) -> str | None:
        """Returns the text for a role; None if there is none."""
        text: str | None = getattr(self, role.value)
        return text


class Texts(_Part, frozen=True, kw_only=True):
    """Texts of the study.

    Attributes:
        instructions: instructions for each role that people play.
        tutorial: instructions for the tutorial drive, for each role; may be omitted.
        waiting: text of the waiting room.
        no_partner: text for people for whom no partner was found.
        debriefing: text at the end.
        declined: text for people who do not consent.
        withdrawn: text after a withdrawal.
    """

    instructions: RoleTexts
    debriefing: Prose
    tutorial: RoleTexts = field(default_factory=RoleTexts)
    waiting: Prose = "You will be connected to another person as soon as one is ready. Please stay on this page."
    no_partner: Prose = "Nobody else is ready at the moment. You can go on waiting, or finish now."
    declined: Prose = "You did not agree, so the study ends here. Nothing about you was kept. You can close this page."
    withdrawn: Prose = "You have withdrawn. Everything that was recorded about you has been deleted."


Questionnaire: TypeAlias = Annotated[list[Item], Meta(max_length=200)]


class Questionnaires(_Part, frozen=True, kw_only=True):
    """Questionnaires before the sessions, after each session, and after the last one; empty ones are left out."""

    before: Questionnaire = []
    after_session: Questionnaire = []
    after: Questionnaire = []


class Study(_Part, frozen=True, kw_only=True):
    """Content of a study file.

    Attributes:
        title: title that people see.
        contact: contact for questions; shown with the consent and at the end.
        conditions: conditions.
        scenarios: towns and storyboards, which take turns; see `dorothie_gym.lab.studies.assignment`.
        consent: information and consent.
        texts: further texts.
        questionnaires: questionnaires.
        assignment: method of assignment.
        session: settings of the sessions.
        tutorial: tutorial drive; None if there is none.
        absence: rules for people who leave.
        waiting_room: rules of the waiting room.
        recruitment: recruitment.
    """

    title: Label
    contact: Label
    conditions: Annotated[list[Condition], Meta(min_length=1, max_length=24)]
    scenarios: Annotated[list[Scenario], Meta(min_length=1, max_length=200)]
    consent: Consent
    texts: Texts
    questionnaires: Questionnaires = field(default_factory=Questionnaires)
    assignment: Assignment = field(default_factory=Assignment)
    session: SessionSettings = field(default_factory=SessionSettings)
    tutorial: Tutorial | None = None
    absence: Absence = field(default_factory=Absence)
    waiting_room: WaitingRoom = field(default_factory=WaitingRoom)
    recruitment: Recruitment = field(default_factory=Recruitment)

    @property
    def statements(self) -> list[str]:
        """Statements to which people agree, with the one on their voice where they can speak."""
        voice = [self.consent.voice] if self.session.speech and self.consent.voice is not None else []
        return [*self.consent.statements, *voice]

    @property
    def people(self) -> tuple[Role, ...]:
        """Roles that people play in any condition."""
        return tuple(role for role in AGENT_ROLES if any(role in each.people for each in self.conditions))

    @property
    def sessions_each(self) -> int:
        """Number of sessions that each group plays."""
        return len(self.conditions) if self.assignment.method is Method.LATIN_SQUARE else 1

    def condition(self, name: str) -> Condition:
        """Returns a condition by name."""
        return next(each for each in self.conditions if each.name == name)

    def questionnaire(self, name: str) -> list[Item]:
        """Returns a questionnaire by name: "before", "after_session" or "after"."""
        found: Mapping[str, list[Item]] = {
            "before": self.questionnaires.before,
            "after_session": self.questionnaires.after_session,
            "after": self.questionnaires.after,
        }
        return found[name]
