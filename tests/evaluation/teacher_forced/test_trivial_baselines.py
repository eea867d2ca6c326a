from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.archive import InferencePoint, nfd_points, ufn_points
from dorothie_gym.evaluation.teacher_forced import MajorityModel, RandomModel, make_floor
from dorothie_gym.ontology import LABELS, DialogueAct, DialogueMove, LandmarkName, PhysicalAction, Role
from tests.session.recording.builders import physical, session, utterance

KFC = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC)
J = PhysicalAction.J_TURN


def said(*acts: DialogueAct) -> list[InferencePoint]:
    events = [e for i, act in enumerate(acts) for e in utterance(i + 1, Role.PARTICIPANT, i, ("word", act))]
    return list(ufn_points(session(events)))


def test_majority_says_the_commonest_move_and_slots_that_over_half_have() -> None:
    points = said(KFC, KFC, DialogueAct.of(DialogueMove.ALIGN))
    model = MajorityModel()
    model.fit_acts(points)
    predicted = model.predict_acts(2)
    assert predicted.moves.tolist() == [int(DialogueMove.INSTRUCT)] * 2
    assert predicted.slots.sum(axis=1).tolist() == [1, 1]
    assert LABELS[int(predicted.slots[0].argmax())] is LandmarkName.KFC


def test_slot_that_just_half_the_points_have_is_not_predicted() -> None:
    points = said(KFC, DialogueAct.of(DialogueMove.INSTRUCT))
    model = MajorityModel()
    model.fit_acts(points)
    assert not model.predict_acts(1).slots.any()


def test_majority_drives_the_commonest_action_at_its_commonest_angle() -> None:
    angles = [90.2, -45.0, 89.8, None]
    events = [*(physical(i, J, angle) for i, angle in enumerate(angles)), physical(9, PhysicalAction.STOP)]
    points = list(nfd_points(session(events)))
    model = MajorityModel()
    model.fit_actions(points)
    predicted = model.predict_actions(len(points))
    assert set(predicted.actions.tolist()) == {J.nfd_class}
    assert set(predicted.angles.tolist()) == {90.0}


def test_random_is_the_same_for_the_same_seed_and_follows_the_frequencies() -> None:
    points = said(*[KFC] * 3, DialogueAct.of(DialogueMove.ALIGN))
    drawn = []
    for seed in (1, 1, 2):
        model = RandomModel(seed)
        model.fit_acts(points)
        drawn.append(model.predict_acts(4000).moves)
    assert np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[0], drawn[2])
    # Standard deviation of the share: sqrt(0.75 * 0.25 / 4000) = 0.007.
    assert np.mean(drawn[0] == int(DialogueMove.INSTRUCT)) == pytest.approx(0.75, abs=0.03)


def test_random_never_predicts_an_unknown_angle() -> None:
    points = list(nfd_points(session([physical(1, J, None)])))
    model = RandomModel(0)
    model.fit_actions(points)
    assert model.predict_actions(1).angles.tolist() == [0.0]


def test_model_that_was_not_fitted_is_refused() -> None:
    with pytest.raises(ValueError, match="fit_acts first"):
        MajorityModel().predict_acts(0)
    with pytest.raises(ValueError, match="fit_actions first"):
        RandomModel(0).predict_actions(0)
    with pytest.raises(ValueError, match="no points"):
        MajorityModel().fit_acts([])
    with pytest.raises(ValueError, match="no points"):
        MajorityModel().fit_actions([])


def test_error_of_unknown_model_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match="'best' is unknown; choose one of majority, random"):
        make_floor("best")
