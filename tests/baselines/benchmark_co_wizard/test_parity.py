"""Parity of the inputs of a playing model and of the recorded session at every point.

The Co-Wizard's own history comes from its observations alone. Words, acts, actions, times and the map are exactly those
of the recording; where it was and what was around it are estimates, and close.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.archive import OBJECT_VALUES, Task
from dorothie_gym.dialogue import Span
from dorothie_gym.evaluation.teacher_forced.features import Columns, HistorySizes, columns_of, gather, points
from dorothie_gym.evaluation.teacher_forced.features.incremental import trajectory_at_tenths
from dorothie_gym.evaluation.teacher_forced.features.session_columns import town_graph
from dorothie_gym.ontology import DialogueAct, DialogueMove, PhysicalAction, Role
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.session.spaces import Physical
from tests.baselines.benchmark_co_wizard.listening import Played, play
from tests.evaluation.teacher_forced.features.played import seen

ESTIMATED = {
    "window_pose", "window_speed", "window_lane", "window_kind", "window_values", "window_objects_mask",
    "kind", "values", "objects_mask",
}  # fmt: skip
"""Fields that depend on the estimated pose and on perception."""

GUESSED = {"move_text"}
"""Words of each act of an utterance with several acts: only the whole utterance is observed."""


@pytest.fixture(scope="module", params=[("brookside", 5, 156.0), ("midtown", 11, 148.0)], ids=lambda case: case[0])
def played(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Played:
    town, seed, seconds = request.param
    return play(tmp_path_factory.mktemp("parity") / "session", town=town, seed=seed, seconds=seconds)


@pytest.fixture(scope="module")
def both(played: Played) -> tuple[Columns, Columns]:
    """The session as the corpus has it, and as its Co-Wizard has it."""
    town, history = played.env.town, played.listener.tracker.history
    return columns_of(played.session), history.encoded.columns(town_graph(town.name, town))


def batches(both: tuple[Columns, Columns], task: Task) -> tuple[dict[str, Any], dict[str, Any]]:
    """All points of a task in both, words spelt out."""
    found = []
    for columns in both:
        table = points(columns, task)
        found.append(seen(columns, gather(columns, table, np.arange(len(table)))))
    return found[0], found[1]


@pytest.mark.parametrize("task", list(Task))
def test_the_points_are_those_of_the_recording(both: tuple[Columns, Columns], task: Task) -> None:
    recorded, live = (points(columns, task) for columns in both)
    assert len(recorded) >= 8
    for name in ("tenth", "label_move", "label_slots", "label_action", "label_angle"):
        np.testing.assert_array_equal(getattr(live, name), getattr(recorded, name), name)


@pytest.mark.parametrize("task", list(Task))
def test_words_acts_actions_times_and_map_are_exactly_those_of_the_recording(
    both: tuple[Columns, Columns], task: Task
) -> None:
    recorded, live = batches(both, task)
    for name in sorted(set(recorded) - ESTIMATED - GUESSED):
        np.testing.assert_array_equal(live[name], recorded[name], name)
    assert (live["move_text"] == recorded["move_text"]).mean() > 0.9


@pytest.mark.parametrize("task", list(Task))
def test_way_and_surroundings_are_those_of_the_recording_but_for_errors_of_estimates(
    both: tuple[Columns, Columns], task: Task
) -> None:
    recorded, live = batches(both, task)
    there = recorded["window_mask"]
    apart = np.abs(live["window_pose"] - recorded["window_pose"])[there]
    turned = np.minimum(apart[:, 2], 360.0 - apart[:, 2])
    assert apart[:, :2].mean() < 0.5 and apart[:, :2].max() < 3.0  # m: GPS, and straight ways between decisions
    assert turned.mean() < 1.5 and turned.max() < 25.0  # degrees
    assert np.abs(live["window_speed"] - recorded["window_speed"])[there].max() < 1.5  # m/s
    assert (live["window_lane"] == recorded["window_lane"])[there].mean() > 0.9
    for prefix, mask in (("window_", "window_objects_mask"), ("", "objects_mask")):
        alike = live[mask] & recorded[mask]
        assert alike.sum() > 0.95 * max(
            live[mask].sum(), recorded[mask].sum()
        )  # glimpses beyond the sight are left out
        same = alike & (live[f"{prefix}kind"] == recorded[f"{prefix}kind"])
        assert same.sum() > 0.9 * alike.sum()
        values, truth = live[f"{prefix}values"][same], recorded[f"{prefix}values"][same]
        for name in ("distance", "length", "width"):
            column = OBJECT_VALUES.index(name)
            assert np.median(np.abs(values[:, column] - truth[:, column])) < 0.5, name  # m


@pytest.mark.parametrize("task", list(Task))
def test_incremental_columns_give_the_batches_of_the_whole_session_at_every_moment(played: Played, task: Task) -> None:
    town = played.env.town
    graph = town_graph(town.name, town)
    compared = 0
    for shown, whole in played.listener.moments:
        columns, reference = _ask(shown, task).encoded.columns(graph), _ask(whole, task).columns(town)
        table, wanted = points(columns, task), points(reference, task)
        if not len(wanted) or wanted.tenth[-1] < shown.frame // FRAMES_PER_TENTH:
            continue  # at UfN points: the participant did not speak just now
        given, right = (seen(each, gather(each, rows, [-1])) for each, rows in ((columns, table), (reference, wanted)))
        for name, values in right.items():
            np.testing.assert_array_equal(given[name], values, name)
        compared += 1
    assert compared >= 8


def _ask(history: Any, task: Task) -> Any:
    """Returns a history with a point of a task at its end."""
    frame = history.frame + FRAMES_PER_TENTH
    if task is Task.RFN:
        return history.said(Role.CO_WIZARD, (Span("-", DialogueAct(DialogueMove.IRRELEVANT)),), frame)
    return history.done(Physical(action=PhysicalAction.STOP), frame) if task is Task.NFD else history


def test_switched_head_lights_change_what_was_perceived_since(played: Played) -> None:
    town = played.env.town
    graph = town_graph(town.name, town)
    lights = Physical(action=PhysicalAction.LIGHT_CHANGE, up=True)
    for shown, whole in played.listener.moments[::16]:
        switched, wanted = (each.done(lights, each.frame - 1) for each in (shown, whole))
        found, right = switched.encoded.columns(graph), wanted.columns(town)
        start = right.looks.start[-2]
        np.testing.assert_array_equal(found.objects.values[found.looks.start[-2] :], right.objects.values[start:])


def test_kept_frames_and_events_do_not_grow_with_the_session(played: Played) -> None:
    sizes = HistorySizes()
    histories = [shown for shown, _ in played.listener.moments]
    assert max(len(trajectory_at_tenths(each.encoded.window.frames)) for each in histories) <= (
        sizes.window * sizes.window_step + 1 + 10
    )
    assert max(len(each.encoded.window.frames) for each in histories) <= 25
    assert max(len(each.encoded.utterances) for each in histories) <= sizes.moves + 2
    assert max(len(each.encoded.actions) for each in histories) <= sizes.actions + 3


def test_hidden_landmarks_are_not_in_it(played: Played) -> None:
    history = played.listener.tracker.history
    known = [row["name"] for row in played.session.header.landmarks if not row["hidden"]]
    assert [row["name"] for row in history.encoded.header.landmarks] == known
    assert len(known) < len(played.session.header.landmarks)
