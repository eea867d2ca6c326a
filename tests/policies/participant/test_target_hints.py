"""The participant describes places as they are, and does not repeat itself."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dorothie_gym.dialogue import Direction, Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.evaluation.analysis.truth_checks.truth import is_true
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology import LandmarkName, Role, StreetName
from dorothie_gym.session.recording.header import LandmarkRow
from tests.evaluation.teacher_forced.features.played import play

P = Predicate
ABOUT_PLACES = (P.LOCATED, P.NEAR, P.LOOKS)


@pytest.fixture(scope="module")
def worlds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("played")
    town = find_town("brookside", None)
    return [SessionWorld(play(folder / str(seed), seed=seed, seconds=300.0), town) for seed in (2, 3, 5, 7, 8, 9)]


def stated(world):
    moves = world.session.moves(Role.PARTICIPANT)
    return [(move, said) for move in moves for said in move.meaning if said.predicate in ABOUT_PLACES]


@pytest.mark.long
def test_what_is_said_of_places_is_true(worlds):
    said = [(world, move, said) for world in worlds for move, said in stated(world) if not said.asks]
    assert len(said) >= 5
    assert {row.predicate for _, _, row in said} >= {P.LOCATED, P.LOOKS}
    for world, move, row in said:
        assert is_true(world, row, move.start, Role.PARTICIPANT) is not False, f"{move.span}: {row}"


def test_looks_of_another_place_are_false(worlds):
    row = next(iter(worlds[0].session.header.landmarks))
    place = next(name for name in LandmarkName if name.label == row["name"])
    wrong = Proposition.of(P.LOOKS, place=place, feature="pink polka dots")
    assert is_true(worlds[0], wrong, 10.0, Role.PARTICIPANT) is False


def test_side_and_corner_are_held_against_the_map(worlds):
    world = worlds[0]
    row: LandmarkRow = next(iter(world.session.header.landmarks))
    place = next(name for name in LandmarkName if name.label == row["name"])
    right = Proposition.of(P.LOCATED, place=place, side=Direction.RIGHT)
    assert is_true(world, right, 10.0, Role.PARTICIPANT) is True
    assert is_true(world, replace(right, negated=True), 10.0, Role.PARTICIPANT) is False
    named = set(world.session.header.street_names)
    absent = next(street for street in StreetName if street.label not in named and street is not StreetName.UNKNOWN)
    corner = Proposition.of(P.LOCATED, place=place, cross=absent)
    assert is_true(world, corner, 10.0, Role.PARTICIPANT) is False
