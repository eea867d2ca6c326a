from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.errors import ActionError
from dorothie_gym.ontology import (
    AGENT_ROLES,
    DialogueAct,
    DialogueMove,
    ExceptionKind,
    LandmarkName,
    MentalAction,
    PhysicalAction,
    Role,
    StreetName,
)
from dorothie_gym.session.spaces import (
    ActionDecoder,
    AdWizardAction,
    CoWizardAction,
    LanePosition,
    Mental,
    ParticipantAction,
    Physical,
    RoleAction,
    SpaceLimits,
    Speech,
    action_space,
    decode_action,
    noop,
)

LIMITS = SpaceLimits()
SPEECH = Speech(act=DialogueAct.of(DialogueMove.INSTRUCT, StreetName.BAITS, LandmarkName.KFC), text="left at Baits")


@pytest.mark.parametrize(
    "action",
    [
        ParticipantAction(),
        ParticipantAction(speech=SPEECH),
        CoWizardAction(),
        CoWizardAction(speech=SPEECH, physical=Physical(action=PhysicalAction.J_TURN, angle=-90)),
        CoWizardAction(mental=Mental(action=MentalAction.PLAN_UPDATE, plan=(3, 0, 63))),
        CoWizardAction(
            mental=Mental(
                action=MentalAction.KNOWLEDGE_UPDATE,
                goals=(LandmarkName.KFC, LandmarkName.SHELL),
                landmark=LandmarkName.PERSON,
                place=LanePosition(lane=7, metres=41),
            )
        ),
        AdWizardAction(),
        AdWizardAction(
            exception=ExceptionKind.SPAWN_VEHICLES, place=LanePosition(lane=5, metres=8), count=3, extent=40
        ),
        AdWizardAction(exception=ExceptionKind.MESSAGE, message="The road is closed\nfor today"),
        AdWizardAction(share=0.5),
    ],
    ids=lambda action: type(action).__name__,
)
def test_decoding_inverts_encoding(action: RoleAction) -> None:
    assert decode_action(action.role, action.encode(LIMITS), LIMITS) == action


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_samples_of_space_are_decoded(role: Role) -> None:
    space, decode = action_space(role, LIMITS), ActionDecoder(role, LIMITS)
    space.seed(3)
    for _ in range(40):
        decode(space.sample())


WRONG: list[tuple[Role, str, Any]] = [
    (Role.PARTICIPANT, "move", 99),
    (Role.PARTICIPANT, "move", -1),
    (Role.PARTICIPANT, "move", True),
    (Role.PARTICIPANT, "move", 1.0),
    (Role.PARTICIPANT, "move", np.float64(1.0)),
    (Role.PARTICIPANT, "move", np.array([1])),
    (Role.PARTICIPANT, "slots", np.zeros(68, dtype=np.int8)),
    (Role.PARTICIPANT, "slots", np.full(69, 2, dtype=np.int8)),
    (Role.PARTICIPANT, "slots", np.full(69, -1, dtype=np.int8)),
    (Role.PARTICIPANT, "slots", np.full(69, 256)),
    (Role.PARTICIPANT, "slots", np.zeros(69)),
    (Role.PARTICIPANT, "utterance", "x" * 161),
    (Role.PARTICIPANT, "utterance", "caf\u00e9"),
    (Role.PARTICIPANT, "utterance", None),
    (Role.CO_WIZARD, "angle", 180),
    (Role.CO_WIZARD, "plan", np.full(12, 65)),
    (Role.CO_WIZARD, "plan", np.array([0] * 11 + [-1])),
    (Role.CO_WIZARD, "plan", np.zeros((3, 4), dtype=np.int64)),
    (Role.CO_WIZARD, "goals", "all"),
    (Role.CO_WIZARD, "lane", 640),
    (Role.AD_WIZARD, "on", 2),
    (Role.AD_WIZARD, "message", b"bytes"),
]


@pytest.mark.parametrize(("role", "field", "value"), WRONG)
def test_error_names_wrong_field(role: Role, field: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"action of {role}: field '{field}'"):
        decode_action(role, {**noop(role, LIMITS), field: value}, LIMITS)


def test_flags_may_be_of_any_integer_type() -> None:
    for kind in (np.int8, np.uint8, np.bool_, np.int64):
        slots = np.zeros(69, dtype=kind)
        slots[12] = 1
        action = decode_action(Role.PARTICIPANT, {"move": 0, "slots": slots, "utterance": ""}, LIMITS)
        assert isinstance(action, ParticipantAction)
        assert action.speech is not None
        assert len(action.speech.act.slots) == 1


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_fields_that_an_action_leaves_out_have_no_effect(role: Role) -> None:
    assert decode_action(role, {}, LIMITS) == decode_action(role, noop(role, LIMITS), LIMITS)


def test_partial_action_stops_the_car_in_silence() -> None:
    action = decode_action(Role.CO_WIZARD, {"physical": PhysicalAction.STOP}, LIMITS)
    assert isinstance(action, CoWizardAction)
    assert action == CoWizardAction(physical=Physical(action=PhysicalAction.STOP, up=False))


def test_error_names_unknown_field_and_the_type_of_an_action() -> None:
    with pytest.raises(ActionError, match="field 'physicl' is unknown; did you mean 'physical'"):
        decode_action(Role.CO_WIZARD, {"physicl": 4}, LIMITS)
    with pytest.raises(ValueError, match="field 'wish' is unknown"):
        decode_action(Role.PARTICIPANT, {**noop(Role.PARTICIPANT, LIMITS), "wish": 1}, LIMITS)
    with pytest.raises(ValueError, match=r"expected a dict of fields or a ParticipantAction, got list \[\]"):
        decode_action(Role.PARTICIPANT, [], LIMITS)  # type: ignore[arg-type]  # a wrong type on purpose
