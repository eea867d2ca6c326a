from dorothie_gym.ontology import AGENT_ROLES, Capability, Role, Sight


def test_co_wizard_sees_neither_hidden_landmarks_nor_the_task() -> None:
    assert not Role.CO_WIZARD.sees & {Sight.HIDDEN_LANDMARKS, Sight.STORYBOARD, Sight.AD_WIZARD_MESSAGES}


def test_participant_sees_hidden_landmarks_but_not_the_plan() -> None:
    assert Sight.HIDDEN_LANDMARKS in Role.PARTICIPANT.sees
    assert Sight.WAYPOINTS not in Role.PARTICIPANT.sees


def test_ad_wizard_sees_everything() -> None:
    assert Role.AD_WIZARD.sees == set(Sight)


def test_only_the_co_wizard_drives_and_only_the_ad_wizard_raises_exceptions() -> None:
    assert [role for role in Role if Capability.PHYSICAL_ACTION in role.may] == [Role.CO_WIZARD]
    assert [role for role in Role if Capability.EXCEPTION in role.may] == [Role.AD_WIZARD]


def test_the_car_is_no_agent_role() -> None:
    assert set(Role) - set(AGENT_ROLES) == {Role.AGENT}


def test_no_sdn_name_belongs_to_two_roles() -> None:
    names = [name for role in Role for name in role.sdn_names]
    assert len(names) == len(set(names)) == 6
