from dorothie_gym.ontology import ExceptionKind, Sensor


def test_ids_are_those_of_the_contract() -> None:
    assert [int(kind) for kind in ExceptionKind] == list(range(12))
    assert int(ExceptionKind.MESSAGE) == 11


def test_environmental_and_task_share_out_all_but_none_and_message() -> None:
    neither = [kind for kind in ExceptionKind if not kind.is_environmental and not kind.is_task]
    assert neither == [ExceptionKind.NONE, ExceptionKind.MESSAGE]
    assert not any(kind.is_environmental and kind.is_task for kind in ExceptionKind)


def test_plan_level_exceptions_are_environmental() -> None:
    assert {kind.label for kind in ExceptionKind if kind.is_plan_level} == {"PlaceProp", "MoveProp", "DeleteProp"}
    assert all(kind.is_environmental for kind in ExceptionKind if kind.is_plan_level)


def test_sensors() -> None:
    assert [sensor.value for sensor in Sensor] == ["blur", "gps", "view"]
