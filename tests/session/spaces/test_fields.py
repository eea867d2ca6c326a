import pytest
from gymnasium import spaces

from dorothie_gym.archive import OBJECT_VALUES, Task
from dorothie_gym.envs.history_space import (
    HistoryObjectColumn,
    act_fields,
    act_space,
    decision_fields,
    decision_space,
    history_fields,
    history_space,
)
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.session.spaces import (
    FieldKind,
    FieldSpec,
    SpaceLimits,
    action_fields,
    action_space,
    dict_space,
    observation_fields,
    observation_space,
)

LIMITS = SpaceLimits()
TABLES = {
    **{
        f"observation of {role}": (observation_fields(role, LIMITS), observation_space(role, LIMITS))
        for role in AGENT_ROLES
    },
    **{f"action of {role}": (action_fields(role, LIMITS), action_space(role, LIMITS)) for role in AGENT_ROLES},
    **{f"history of {task}": (history_fields(task, LIMITS), history_space(task, LIMITS)) for task in Task},
    "acts": (act_fields(), act_space()),
    "decisions": (decision_fields(), decision_space()),
}
CASES = [
    pytest.param(field, space, id=f"{name}: {field.name}")
    for name, (fields, space) in TABLES.items()
    for field in fields
]


@pytest.mark.parametrize("name", TABLES)
def test_space_has_exactly_the_specified_fields(name: str) -> None:
    fields, space = TABLES[name]
    assert len({field.name for field in fields}) == len(fields)
    assert {field.name for field in fields} == set(space)


@pytest.mark.parametrize(("field", "space"), CASES)
def test_specification_describes_the_space_of_its_field(field: FieldSpec, space: spaces.Dict) -> None:
    part = space[field.name]
    assert isinstance(part, getattr(spaces, field.kind.value))
    assert field.meaning and field.unit
    if field.kind is FieldKind.TEXT:
        assert field.dtype == "str" and "characters" in field.range
        assert part.max_length == field.high
    else:
        assert (part.shape, str(part.dtype)) == (field.shape, field.dtype)
        assert field.range == f"[{field.low:g}, {field.high:g}]"


@pytest.mark.parametrize(("field", "space"), [case for case in CASES if case.values[0].columns is not None])
def test_tables_have_a_documented_value_for_each_column(field: FieldSpec, space: spaces.Dict) -> None:
    assert field.columns is not None
    assert space[field.name].shape[-1] == len(field.columns)
    assert [column.value for column in field.columns] == list(range(len(field.columns)))
    assert all(column.unit and column.meaning for column in field.columns)


def test_text_is_bounded_in_length_and_characters() -> None:
    space = observation_space(Role.PARTICIPANT, LIMITS)["message"]
    assert space.contains("Road closed.") and space.contains("") and not space.contains("ü")


def test_columns_of_perceived_objects_match_the_recording() -> None:
    assert tuple(column.name.lower() for column in HistoryObjectColumn) == OBJECT_VALUES


def test_dict_space_is_built_in_the_given_fields_only() -> None:
    assert list(dict_space(act_fields()[:1])) == ["move"]
