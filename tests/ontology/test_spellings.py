from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import (
    LABELS,
    ActionValue,
    DialogueAct,
    DialogueMove,
    ExceptionKind,
    GoalStatus,
    LandmarkName,
    MentalAction,
    ObjectClass,
    PhysicalAction,
    PropKind,
    Role,
    Sensor,
    Slot,
    StreetName,
    WeatherParameter,
    parse_act,
    parse_action_value,
    parse_exception,
    parse_goal_status,
    parse_landmark,
    parse_mental_action,
    parse_move,
    parse_object_class,
    parse_physical_action,
    parse_prop,
    parse_role,
    parse_sensor,
    parse_slot,
    parse_slot_value,
    parse_street,
    parse_weather_parameter,
)

Parser = Callable[[str], object]

# Every vocabulary: its parser and each member with its own spelling.
OWN_SPELLINGS: list[tuple[Parser, str, object]] = [
    *((parse_move, member.label, member) for member in DialogueMove),
    *((parse_slot, member.label, member) for member in Slot),
    *((parse_action_value, member.label, member) for member in ActionValue),
    *((parse_street, member.label, member) for member in StreetName),
    *((parse_landmark, member.label, member) for member in LandmarkName),
    *((parse_goal_status, member.label, member) for member in GoalStatus),
    *((parse_object_class, member.label, member) for member in ObjectClass),
    *((parse_physical_action, member.label, member) for member in PhysicalAction),
    *((parse_mental_action, member.label, member) for member in MentalAction),
    *((parse_exception, member.label, member) for member in ExceptionKind),
    *((parse_role, member.value, member) for member in Role),
    *((parse_sensor, member.value, member) for member in Sensor),
    *((parse_weather_parameter, member.value, member) for member in WeatherParameter),
    *((parse_prop, member.value, member) for member in PropKind),
]

PARSERS: list[Parser] = list(dict.fromkeys(parser for parser, _, _ in OWN_SPELLINGS))


@st.composite
def careless(draw: st.DrawFn, text: str) -> str:
    """Draws variants of a text in case, spaces, underscores and hyphens."""
    chars = [draw(st.sampled_from([char, char.upper(), char.lower()])) for char in text]
    strays = [draw(st.sampled_from(["", "", "", " ", "_", "-", "\t"])) for _ in range(len(chars) + 1)]
    return strays[0] + "".join(char + stray for char, stray in zip(chars, strays[1:], strict=True))


@given(st.sampled_from(OWN_SPELLINGS), st.data())
def test_own_spelling_is_read_in_any_case_and_punctuation(
    entry: tuple[Parser, str, object], data: st.DataObject
) -> None:
    parser, text, member = entry
    assert parser(text) is member
    assert parser(data.draw(careless(text))) is member


@pytest.mark.parametrize(
    ("parser", "text", "member"),
    [
        (parse_slot, "StreetName", Slot.STREET),
        (parse_object_class, "Vehicle", ObjectClass.VEHICLES),
        (parse_goal_status, "Completed", GoalStatus.COMPLETE),
        (parse_landmark, "Seven Eleven", LandmarkName.SEVEN_ELEVEN),
        (parse_action_value, "Jturn", ActionValue.J_TURN),
        (parse_physical_action, "Jturn ", PhysicalAction.J_TURN),
        (parse_mental_action, "LandmarkUpdate", MentalAction.KNOWLEDGE_UPDATE),
        (parse_role, "dorothy", Role.PARTICIPANT),
        (parse_role, "wizard", Role.CO_WIZARD),
        (parse_role, "ad_wizard", Role.AD_WIZARD),
        (parse_role, "agent", Role.AGENT),
        (parse_role, "planner", Role.AGENT),
        (parse_role, "system", Role.AGENT),
        (parse_exception, "set_weather", ExceptionKind.WEATHER),
        (parse_exception, "prop_create", ExceptionKind.PLACE_PROP),
        (parse_exception, "make_peds", ExceptionKind.SPAWN_PEDESTRIANS),
        (parse_exception, "make_cars", ExceptionKind.SPAWN_VEHICLES),
        (parse_prop, "static.prop.streetbarrier", PropKind.STREET_BARRIER),
    ],
)
def test_sdn_spelling_is_read(parser: Parser, text: str, member: object) -> None:
    assert parser(text) is member


@pytest.mark.parametrize("value", LABELS, ids=lambda value: f"{value.slot.label}-{value.label}")
def test_slot_value_is_read_within_its_slot(value: LandmarkName) -> None:
    assert parse_slot_value(value.slot, f" {value.label} ") is value


@pytest.mark.parametrize("parser", PARSERS)
@given(text=st.text(alphabet="qxzжλ '.", max_size=12))
def test_error_names_unknown_text(parser: Parser, text: str) -> None:
    with pytest.raises(OntologyError, match="nearest known spelling") as error:
        parser(text)
    assert repr(text) in str(error.value)


@pytest.mark.parametrize("parser", PARSERS)
@pytest.mark.parametrize("text", [None, 3])
def test_parsers_raise_error_for_non_text(parser: Parser, text: object) -> None:
    with pytest.raises(OntologyError, match="expected a text"):
        parser(text)  # type: ignore[arg-type]  # a wrong type on purpose


def test_error_names_vocabulary_and_nearest_spelling() -> None:
    with pytest.raises(OntologyError, match=r"value of slot Street.*'Bonistel'.*'Bonisteel'"):
        parse_slot_value(Slot.STREET, "Bonistel")


def test_null_slot_has_no_values() -> None:
    with pytest.raises(OntologyError, match=r"slot Null.*no values"):
        parse_slot_value(Slot.NULL, "Unknown")


def test_act_is_read_from_sdn_spellings() -> None:
    act = parse_act(" Instruct", {"StreetName": ["Fuller"], "Landmark": ["Seven Eleven", "KFC"], "Status": "Completed"})
    assert act == DialogueAct.of(
        DialogueMove.INSTRUCT,
        StreetName.FULLER,
        LandmarkName.SEVEN_ELEVEN,
        LandmarkName.KFC,
        GoalStatus.COMPLETE,
    )


@pytest.mark.parametrize("slots", [None, {}, {"Null": ["Null"]}, {"Action": []}, {"Street": None}, {"Null": ""}])
def test_act_without_values_is_read(slots: dict[str, list[str] | str | None] | None) -> None:
    assert parse_act("Acknowledge", slots) == DialogueAct(DialogueMove.ACKNOWLEDGE)


@pytest.mark.parametrize(
    ("move", "slots", "named"),
    [
        ("Instrct", {}, "'Instruct'"),
        ("Instruct", {"Sreet": ["Fuller"]}, "'Street'"),
        ("Instruct", {"Street": ["KFC"]}, "slot Street"),
    ],
)
def test_act_with_unknown_part_raises_error(move: str, slots: dict[str, list[str]], named: str) -> None:
    with pytest.raises(OntologyError, match=named):
        parse_act(move, slots)
