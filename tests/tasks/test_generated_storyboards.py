"""Generated storyboards: valid, readable, varied, equal for equal names, and playable in any town."""

from __future__ import annotations

import functools
import hashlib
import re
from collections import Counter

import numpy as np
import pytest

from dorothie_gym.errors import StoryboardError
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.session.spaces.fields import STORY_LENGTH, SpaceLimits, plain_text
from dorothie_gym.tasks import (
    StoryboardSpecification,
    StoryboardTemplate,
    TaskState,
    bind,
    generate_template,
    is_shipped_story,
    is_template_name,
    load_template,
    needed_places,
    template_names,
)
from dorothie_gym.tasks.parsing import check
from dorothie_gym.tasks.purposes import find_items, read_message, read_people, read_purpose
from dorothie_gym.tasks.storyboard import references

from .builders import grid_places

SEEDS = range(200)


@functools.cache
def templates() -> list[StoryboardTemplate]:
    return [generate_template(StoryboardSpecification(seed=seed)) for seed in SEEDS]


@functools.cache
def boards() -> list:
    return [bind(template, grid_places(24), np.random.default_rng(k)) for k, template in enumerate(templates())]


def test_every_template_is_valid_and_fits_the_spaces() -> None:
    limits = SpaceLimits()
    for template, board in zip(templates(), boards(), strict=True):
        check(template)
        assert len(template.subgoals) <= limits.subgoals and len(board.landmarks) <= limits.landmarks
        assert len(board.story) <= STORY_LENGTH and plain_text(board.story, STORY_LENGTH) == board.story
        texts = [board.story, *(goal.description for goal in board.subgoals)]
        assert not any(re.search(r"[{}$]", text) for text in texts), board.name
        assert {name for _, text in template.texts() for name in references(text)}


def test_templates_are_equal_for_equal_names_and_different_otherwise() -> None:
    stories = {template.story for template in templates()}
    assert len(stories) == len(SEEDS)
    shipped = {load_template(name).story for name in template_names()}
    assert not stories & shipped
    for seed in (0, 7, 999_999_999_999):
        named = StoryboardSpecification(seed=seed, stops=5)
        template = load_template(str(named))
        generate_template.cache_clear()
        assert load_template(str(named)) == template and template.name == str(named) == f"generated:{seed},stops=5"


def test_templates_are_those_of_every_processor() -> None:
    content = repr([generate_template(StoryboardSpecification(seed=seed)) for seed in range(20)])
    assert hashlib.sha256(content.encode()).hexdigest()[:16] == "3024a3cf7fab954d"


@pytest.mark.parametrize("stops", [2, 3, 4, 5, 6])
def test_a_template_has_the_number_of_stops_of_its_name(stops: int) -> None:
    for seed in range(60):
        template = generate_template(StoryboardSpecification(seed=seed, stops=stops))
        assert sum(not goal.trigger for goal in template.subgoals) == stops


def test_each_subgoal_has_a_reason_and_each_change_its_message() -> None:
    for template in templates():
        for goal in template.subgoals:
            assert goal.reason
            given = (goal.messages.trigger, goal.messages.delete, goal.messages.change)
            assert list(map(bool, given)) == [goal.trigger, goal.delete, bool(goal.change)], goal
        assert any(goal.trigger or goal.delete or goal.change for goal in template.subgoals)


def test_templates_use_every_feature_and_word() -> None:
    goals = [goal for template in templates() for goal in template.subgoals]
    for feature in ("after", "trigger", "delete", "change", "change_destination", "delete_after_subgoal", "leaves"):
        assert len({getattr(goal, feature) for goal in goals}) > 1, feature
    kinds = Counter(variable.category for template in templates() for variable in template.variables)
    assert len(kinds) == 6 and min(kinds.values()) > 10
    hidden = sum(bool(template.hidden) for template in templates())
    assert 0.6 < hidden / len(SEEDS) < 0.9
    assert len({template.story.split(". ")[-1] for template in templates()}) > 60


def test_participants_read_every_errand_and_every_message() -> None:
    for board in boards():
        state, people = TaskState(board), read_people(board.story)
        for i, goal in enumerate(board.subgoals):
            label = board.landmarks[goal.landmark].label
            for text in (state.description(i), goal.change):
                if text is None:
                    continue
                found = read_purpose(text)
                assert found.reason and (found.action or found.person), text
                assert found.items == find_items(text) or not find_items(text), text
                assert found.action is None or not re.search(r"\byour?\b", found.action), text
            if label in state.description(i):
                found = read_purpose(state.description(i))
                assert found.action is not None and label not in found.action
            for _, message in goal.messages.given():
                read = read_message(str(message), people)
                assert read.sender and read.channel is message.channel and read.reason, str(message)


def test_the_story_names_whom_the_errands_are_for() -> None:
    for board in boards():
        people = read_people(board.story, *(goal.description for goal in board.subgoals))
        assert people
        for goal in board.subgoals:
            person = read_purpose(goal.description).person
            if person is not None and person[0].isupper():
                assert person.removesuffix("'s") in people, (person, people)


def test_no_name_of_a_person_is_one_of_a_place() -> None:
    taken = {word.lower() for value in (*LandmarkName, *StreetName) for word in re.findall(r"\w+", value.label)}
    for board in boards():
        for name in read_people(board.story):
            assert not {word.lower() for word in re.findall(r"\w+", name)} & taken


@pytest.mark.parametrize(
    "name", ["generated:", "generated:x", "generated:7,stops=1", "generated:7,stops=7", "generated:-1"]
)
def test_a_wrong_name_is_refused_with_the_remedy(name: str) -> None:
    assert is_template_name(name)
    with pytest.raises(StoryboardError, match=re.escape(name)):
        load_template(name)


def test_stories_are_not_taken_for_shipped_ones_and_need_a_place_each() -> None:
    for template, board in zip(templates()[:60], boards(), strict=False):
        assert not is_shipped_story(board.story)
        assert needed_places(template) == len(template.variables)
