"""Talk tasks: drawn alike from equal seeds, playable in any town, and silent about the answer."""

from __future__ import annotations

import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.talk_kinds import KINDS, draw_talk_task
from dorothie_gym.session.talk_tasks import TARGET, Reaction, closure_in
from dorothie_gym.tasks.briefs import TalkFamily, read_brief

SEEDS = range(90)


@pytest.mark.parametrize("family", TalkFamily)
@pytest.mark.parametrize("town_name", ["brookside", "midtown"])
def test_every_seed_gives_a_task_that_its_participant_can_read(family: TalkFamily, town_name: str) -> None:
    town = load_town(town_name)
    kinds, reactions = set(), []
    for seed in SEEDS:
        scenario = draw_scenario(town, None, seed, None, family)
        assert scenario == draw_scenario(town, None, seed, None, family)
        task = draw_talk_task(town, scenario.street_names, family, seed)
        assert read_brief(scenario.storyboard.story) == task.brief and TARGET not in scenario.storyboard.story
        assert all(len(text) <= 160 for text in (task.brief.request, *(reply.text for reply in task.brief.replies)))
        assert (task.reason is not None) == (task.reaction is Reaction.ADMIT)
        assert bool(task.brief.replies) == (task.reaction is Reaction.ASK)
        kinds.add(task.kind)
        reactions.append(task.reaction)
    assert kinds == set(KINDS[family]) and len(KINDS[TalkFamily.ASK_FIRST]) + len(KINDS[TalkFamily.ADMIT_IT]) >= 12
    share = sum(each not in (Reaction.ADMIT, Reaction.ASK) for each in reactions) / len(reactions)
    assert 0.15 < share < 0.45


def test_the_order_of_landmarks_does_not_give_the_target_away() -> None:
    town = load_town("midtown")
    first = []
    for seed in SEEDS:
        scenario = draw_scenario(town, None, seed, None, TalkFamily.ASK_FIRST)
        task = draw_talk_task(town, scenario.street_names, TalkFamily.ASK_FIRST, seed)
        names = [name for name, _ in task.landmarks]
        assert [name.value for name in names] == sorted(name.value for name in names)
        if task.target is not None and names.count(LandmarkName.HOUSE) == 2:
            first.append(task.target == names.index(LandmarkName.HOUSE))
    assert 0.2 < sum(first) / len(first) < 0.8


def test_only_the_ad_wizard_learns_of_a_closed_street() -> None:
    town = load_town("midtown")
    closed = 0
    for seed in SEEDS:
        scenario = draw_scenario(town, None, seed, None, TalkFamily.ADMIT_IT)
        task = draw_talk_task(town, scenario.street_names, TalkFamily.ADMIT_IT, seed)
        hidden = [subgoal.description for subgoal in scenario.storyboard.subgoals if subgoal.trigger]
        assert closure_in("\n".join(hidden)) == task.closed
        assert "Close" not in scenario.storyboard.story
        closed += task.closed is not None
    assert closed
