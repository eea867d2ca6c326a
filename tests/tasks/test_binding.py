import itertools
import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.errors import StoryboardError
from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks import bind, catalogue, load_template, needed_places, template_names
from dorothie_gym.tasks.binding import SITE_SPACING, cast, spread_places

from .builders import FakePlace, bound, grid_places, parse, plain, templates


def variables(*categories):
    return [[f"V{k}", category] for k, category in enumerate(categories)]


def cast_of(*categories, seed=0, dependents=(), subgoals=({}, {})):
    fields = plain(*subgoals, variables=variables(*categories), dependents=list(dependents))
    return cast(parse(fields), np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(30))
def test_wide_category_leaves_kinds_for_narrow_one(seed):
    parts = cast_of("places", "places.cafe", "places.stores", seed=seed, subgoals=({"destination": "House"}, {}))
    assert parts["$V1"] is LandmarkName.COCO
    assert len(set(parts.values())) == len(parts)


def test_every_kind_that_fits_is_drawn():
    drawn = Counter(
        cast_of("places.restaurants", seed=seed, subgoals=({"destination": "Coco"}, {}))["$V0"] for seed in range(200)
    )
    assert sorted(name.label for name in drawn if name is not LandmarkName.KFC) == ["BurgerKing", "Panera", "Qdoba"]
    assert min(drawn.values()) > 25


def test_houses_and_people_are_repeated():
    parts = cast_of(*["places.residential"] * 3, *["people"] * 2)
    assert Counter(parts.values())[LandmarkName.HOUSE] == 3
    assert Counter(parts.values())[LandmarkName.PERSON] == 2


def test_explicitly_named_landmark_is_not_bound_to_variable():
    for seed in range(20):
        parts = cast_of("places.stores", subgoals=({"destination": "Ikea"}, {}), seed=seed)
        assert parts["$V0"] is LandmarkName.SEVEN_ELEVEN


def test_dependent_restricts_category_to_kinds_with_attribute():
    for seed in range(20):
        parts = cast_of("places", seed=seed, dependents=[["A", "V0.actions"]], subgoals=({"destination": "KFC"}, {}))
        assert parts["$V0"].label in ("Ikea", "SevenEleven")  # Shell is named outright


REFUSED = {
    "more names than landmarks": (
        {"variables": variables(*["places.stores"] * 3)},
        r"variables: there are not enough different landmarks for V0 .places.stores.*besides KFC, Shell",
    ),
    "named and wanted": ({"variables": variables("places.gasstation")}, "variables: there are not enough"),
    "attribute that none has": (
        {"variables": variables("places.residential"), "dependents": [["I", "V0.items"]]},
        r"dependents\.I: no landmark of 'places.residential' has the attribute 'items'; it has: none",
    ),
    "other attribute": (
        {"variables": variables("places.cafe"), "dependents": [["I", "V0.items"]]},
        r"dependents\.I: no landmark of 'places.cafe' has the attribute 'items'; it has: menuitems",
    ),
    "too few values": (
        {"variables": variables("places.cafe"), "dependents": [[f"I{k}", "V0.menuitems"] for k in range(6)]},
        r"dependents\.I0: 6 different V0.menuitems are requested, but only 5 exist; request fewer",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_infeasible_templates_raise_error(case):
    fields, message = REFUSED[case]
    with pytest.raises(StoryboardError, match="^storyboard test: " + message):
        parse(plain({}, {}, **fields))


def closest_pair(places):
    return min(
        min(math.dist(a.position, b.position), math.dist(a.waypoint, b.waypoint))
        for a, b in itertools.combinations(places, 2)
    )


@pytest.mark.parametrize("seed", range(20))
def test_sites_are_spaced_although_many_are_close(seed):
    chosen = spread_places(grid_places(400, spacing=6.0, lanes=20), 12, np.random.default_rng(seed))
    assert len({place.id for place in chosen}) == 12
    assert closest_pair(chosen) >= SITE_SPACING


@pytest.mark.parametrize("seed", range(20))
def test_unused_lanes_are_preferred(seed):
    chosen = spread_places(grid_places(64, lanes=8), 12, np.random.default_rng(seed))
    assert len({place.lane for place in chosen[:8]}) == 8


def test_crowded_town_gives_distinct_sites_farthest_first():
    row = [FakePlace(k, 0, float(k), (float(k), 2.0), (float(k), 0.0), 0) for k in range(10)]
    chosen = spread_places(row, 2, np.random.default_rng(0))
    assert closest_pair(chosen) >= 4.0
    assert {place.id for place in spread_places(row, 10, np.random.default_rng(0))} == set(range(10))


def test_opposite_sites_are_not_both_chosen_while_others_are_free():
    pairs = [
        FakePlace(2 * k + side, 2 * k + side, 0.0, (30.0 * k, 20.0 * side), (30.0 * k, 9.0 + 2.0 * side), k)
        for k in range(6)
        for side in (0, 1)
    ]
    chosen = spread_places(pairs, 6, np.random.default_rng(1))
    assert {place.street for place in chosen} == set(range(6))


SEEDS = st.integers(0, 2**32 - 1)


@given(templates(), SEEDS)
@settings(max_examples=150, deadline=None)
def test_every_template_binds_to_town_of_24_sites(fields, seed):
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
def test_equal_seeds_give_equal_storyboards(seed):
    template = load_template("low_battery")
    first, second = (bind(template, grid_places(24), np.random.default_rng(seed)) for _ in range(2))
    assert first == second


def test_other_seeds_give_other_sites_and_values():
    template = load_template("community_picnic")
    boards = [bind(template, grid_places(24), np.random.default_rng(seed)) for seed in range(20)]
    assert len({board.story for board in boards}) > 15
    assert len({tuple(landmark.site for landmark in board.landmarks) for board in boards}) == 20


@pytest.mark.parametrize("name", template_names())
def test_every_package_template_binds_to_small_town(name):
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


def test_story_landmarks_get_best_spaced_sites():
    fields = plain({}, {}, variables=[["A", "people"], ["B", "people"]])
    fields["subgoals"] = [{"destination": "$A", "description": "a"}, {"destination": "$B", "description": "b"}]
    for seed in range(20):
        board = bind(parse(fields), grid_places(33, lanes=3), np.random.default_rng(seed))
        first, second = (board.landmarks[subgoal.landmark] for subgoal in board.subgoals)
        assert first.lane != second.lane


def test_repeated_landmarks_are_numbered_on_the_map():
    board = bound({}, {}, variables=[["A", "people"], ["B", "people"], ["C", "places.residential"]])
    assert [landmark.label for landmark in board.landmarks[8:]] == ["House", "Person 1", "Person 2"]


def test_changed_subgoal_has_its_other_landmark():
    board = bound({"change": "Go to Coco", "change_destination": "Coco"}, {"change": "Only look"})
    assert board.landmarks[board.subgoals[0].change_landmark or 0].name.label == "Coco"
    assert board.subgoals[1].change == "Only look" and board.subgoals[1].change_landmark is None


def _two_people():
    fields = plain({}, {}, variables=[["A", "people"], ["B", "people"]])
    fields["subgoals"] = [{"destination": "$A", "description": "a"}, {"destination": "$B", "description": "b"}]
    return parse(fields)


def test_town_with_fewer_sites_than_the_story_has_landmarks_raises_error():
    with pytest.raises(StoryboardError, match="2 landmarks need as many places, but the town has 1; use a larger"):
        bind(_two_people(), grid_places(1), np.random.default_rng(0))
    assert needed_places(_two_people()) == 2
    assert len(bind(_two_people(), grid_places(2), np.random.default_rng(0)).landmarks) == 2


@pytest.mark.parametrize(
    ("places", "landmarks"), [(2, 2), (3, 2), (4, 3), (7, 6), (10, 9), (11, 11), (12, 11), (40, 11)]
)
def test_a_small_town_has_fewer_landmarks_besides_those_of_the_story(places, landmarks):
    board = bind(_two_people(), grid_places(places), np.random.default_rng(0))
    assert len(board.landmarks) == landmarks
    assert [landmark.index for landmark in board.landmarks] == list(range(landmarks))
    assert len({landmark.site for landmark in board.landmarks}) == landmarks
    assert [board.landmarks[goal.landmark].name.label for goal in board.subgoals] == ["Person", "Person"]
    assert len({landmark.label for landmark in board.landmarks}) == landmarks


def test_storyboard_name_is_configurable():
    template = load_template("school_run")
    assert bind(template, grid_places(24), np.random.default_rng(0), name="monday").name == "monday"
