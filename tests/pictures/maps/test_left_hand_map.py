"""Maps of towns with traffic on the left: the paint and the posts of a mirror image are mirrored."""

from collections import Counter

import numpy as np
import pytest

from dorothie_gym.maps import load_town, mirrored
from dorothie_gym.pictures.maps.map_layers import MapLayers


@pytest.fixture(scope="module")
def layers() -> tuple[MapLayers, MapLayers]:
    town = load_town("midtown")
    return MapLayers(town), MapLayers(mirrored(town))


def test_lines_of_a_mirror_image_are_mirrored(layers: tuple[MapLayers, MapLayers]) -> None:
    one, other = (each.borders for each in layers)
    assert one.outer_neighbour == other.outer_neighbour and one.divided == other.divided
    assert Counter((line.kind, line.sign, line.lanes) for line in one.lines) == Counter(
        (line.kind, -line.sign, line.lanes) for line in other.lines
    )
    assert all(line.outer == (line.sign < 0) for line in other.lines)
    for line, image in zip(one.lines, other.lines, strict=True):
        np.testing.assert_allclose(image.points, line.points * (1.0, -1.0, 1.0), atol=1e-6)
        np.testing.assert_allclose(image.gap, line.gap, atol=1e-6)


def test_lights_and_signs_stand_at_the_kerb_on_the_left(layers: tuple[MapLayers, MapLayers]) -> None:
    one, other = (sorted((post.kind, *post.at) for post in each.posts) for each in layers)
    assert other == sorted((kind, x, -y) for kind, x, y in one)
    town = layers[1].town
    for post in layers[1].posts:
        lane = town.lanes[post.lanes[0]]
        if len(post.lanes) > 1 or town.neighbour(lane.id, town.traffic.to_kerb) is None:
            kerb = next(k for k in post.lanes if town.neighbour(k, town.traffic.to_kerb) not in post.lanes)
            if town.neighbour(kerb, town.traffic.to_kerb) is None:
                assert town.lanes[kerb].project(np.array(post.at))[1] < 0.0


def test_the_paint_of_a_mirror_image_is_mirrored(layers: tuple[MapLayers, MapLayers]) -> None:
    def painted(each: MapLayers, sign: float) -> Counter[tuple[object, ...]]:
        middles = [(shape.colour, *np.round(shape.points.mean(axis=0) * (1.0, sign), 3)) for shape in each._paint()]
        return Counter((colour, x + 0.0, y + 0.0) for colour, x, y in middles)

    one, other = painted(layers[0], 1.0), painted(layers[1], -1.0)
    assert sum(((one - other) + (other - one)).values()) < 0.02 * sum(one.values())
