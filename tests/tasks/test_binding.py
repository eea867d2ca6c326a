import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.tasks import StoryboardError, bind, catalogue, load_template, template_names

from .builders import bound, grid_places, parse, plain, templates

SEEDS = st.integers(0, 2**32 - 1)


@given(templates(), SEEDS)
@settings(max_examples=150, deadline=None)
def test_any_template_binds_to_a_town_of_24_places(fields, seed):
    template, places = parse(fields), grid_places(24)
    storyboard = bind(template, places, np.random.default_rng(seed))
    landmarks = storyboard.landmarks
    assert [landmark.name for landmark in landmarks[:10]] == list(catalogue())
    assert [landmark.index for landmark in landmarks] == list(range(len(landmarks)))
    assert len({landmark.site for landmark in landmarks}) == len(landmarks)
    for landmark in landmarks:
        assert landmark.position == places[landmark.site].position
        assert landmark.lane == places[landmark.site].lane
    at = {}
    for row, subgoal in zip(fields["subgoals"], storyboard.subgoals, strict=True):
        at[row["destination"]] = subgoal.landmark
        if "change_destination" in row:
            at[row["change_destination"]] = subgoal.change_landmark
    assert len(set(at.values())) == len(at), "variables must lie at different landmarks"
    for name, category in fields["variables"]:
        if f"${name}" in at:
            landmark = landmarks[at[f"${name}"]]
            assert landmark.category.startswith(category)
            assert landmark.hidden == (name in fields["hidden_from_wizard"])
    assert sum(landmark.hidden for landmark in landmarks) == len(fields["hidden_from_wizard"])
    texts = [storyboard.story, *(subgoal.description for subgoal in storyboard.subgoals)]
    assert not any("$" in text for text in texts)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_the_same_seed_gives_the_same_storyboard(seed):
    template = load_template("low_battery")
    first, second = (bind(template, grid_places(24), np.random.default_rng(seed)) for _ in range(2))
    assert first == second


def test_other_seeds_give_other_places_and_things():
    template = load_template("community_picnic")
    boards = [bind(template, grid_places(24), np.random.default_rng(seed)) for seed in range(20)]
    assert len({board.story for board in boards}) > 15
    assert len({tuple(landmark.site for landmark in board.landmarks) for board in boards}) == 20


@pytest.mark.parametrize("name", template_names())
def test_every_template_of_the_package_binds_to_a_small_town(name):
    for seed in range(10):
        storyboard = bind(load_template(name), grid_places(14), np.random.default_rng(seed))
        assert storyboard.name == name
        assert "$" not in storyboard.story


def test_dependents_of_one_attribute_differ():
    variables, dependents = [["P", "places.cafe"]], [[f"D{k}", "P.menuitems"] for k in range(5)]
    for seed in range(20):
        story = "; ".join(f"$D{k}" for k in range(5))
        board = bound({}, {}, seed=seed, story=story, variables=variables, dependents=dependents)
        assert len(set(board.story.split("; "))) == 5


def test_the_landmarks_of_the_story_get_the_best_spread_places():
    fields = plain({}, {}, variables=[["A", "people"], ["B", "people"]])
    fields["subgoals"] = [{"destination": "$A", "description": "a"}, {"destination": "$B", "description": "b"}]
    for seed in range(20):
        board = bind(parse(fields), grid_places(33, lanes=3), np.random.default_rng(seed))
        first, second = (board.landmarks[subgoal.landmark] for subgoal in board.subgoals)
        assert first.lane != second.lane


def test_repeated_landmarks_are_numbered_on_the_map():
    board = bound({}, {}, variables=[["A", "people"], ["B", "people"], ["C", "places.residential"]])
    assert [landmark.label for landmark in board.landmarks[8:]] == ["House", "Person 1", "Person 2"]


def test_a_changed_subgoal_knows_its_other_landmark():
    board = bound({"change": "Go to Coco", "change_destination": "Coco"}, {"change": "Only look"})
    assert board.landmarks[board.subgoals[0].change_landmark or 0].name.label == "Coco"
    assert board.subgoals[1].change == "Only look" and board.subgoals[1].change_landmark is None


def test_a_town_with_too_few_places_is_refused():
    template = parse(plain({}, {}, variables=[["A", "people"], ["B", "people"]]))
    with pytest.raises(StoryboardError, match="11 landmarks need as many places, but the town has 10; use a larger"):
        bind(template, grid_places(10), np.random.default_rng(0))
    assert len(bind(template, grid_places(11), np.random.default_rng(0)).landmarks) == 11


def test_a_storyboard_may_be_given_another_name():
    template = load_template("school_run")
    assert bind(template, grid_places(24), np.random.default_rng(0), name="monday").name == "monday"
