"""Words on maps are legible: enough contrast, on top of routes, clear of bars and marks, and no legend entry lost."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.folds import TownFold
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps import map_sheet
from dorothie_gym.pictures.maps.floating_names import FloatingNames, box_around, overlap
from dorothie_gym.pictures.maps.map_sheet import Legend, legend_place, sheet_painter
from dorothie_gym.pictures.maps.town_map import MapPainter
from dorothie_gym.pictures.views.aerial import AerialView
from dorothie_gym.pictures.views.scene import CarView, Pin, Scene
from dorothie_gym.support.libraries import pygame

SIZE = (700, 700)


def luminance(colour: tuple[int, int, int]) -> float:
    """Relative luminance (WCAG 2.1)."""
    parts = np.array(colour) / 255.0
    linear = np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one: tuple[int, int, int], other: tuple[int, int, int]) -> float:
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize(
    ("ink", "ground"),
    [
        *((ink, ground) for ink in palette.STATE_INK.values() for ground in (palette.PAPER, palette.PANEL)),
        *((ink, ground) for ink in (palette.INK, palette.INK_SOFT) for ground in (palette.SHEET, palette.PANEL)),
        (palette.STREET_NAME, palette.ROAD),
        (palette.INK, palette.COUNTRY),
        (palette.SIGN_WHITE, palette.PIN),
        (palette.PAPER, palette.EXCEPTION),
    ],
)
def test_words_have_enough_contrast(ink: tuple[int, int, int], ground: tuple[int, int, int]) -> None:
    assert contrast(ink, ground) >= 4.5


def test_words_about_goals_have_the_hue_of_their_pins() -> None:
    assert palette.STATE_INK.keys() == palette.STATE.keys()
    for state, ink in palette.STATE_INK.items():
        assert np.argmax(ink) == np.argmax(palette.STATE[state])
        assert luminance(ink) <= luminance(palette.STATE[state])


# --- Legend -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", [9.0, 12.7, 20.0, 36.0])
@pytest.mark.parametrize("beside", [0.0, 20.0, 40.0, 60.0])
def test_there_is_room_for_every_entry_of_a_legend(unit: float, beside: float) -> None:
    place = legend_place(unit, beside * unit, 106.0 * unit)
    assert map_sheet._columns_width(map_sheet._TEXTS, place.rows, unit) <= (106.0 if place.below else beside) * unit
    assert place.below or place.rows <= 6


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("midtown", (1400, 1372)),
        ("northgate", None),
        ("brookside", (1000, 900)),
        ("generated:2,size=small,style=organic", (1400, 1400)),
    ],
)
def test_legends_show_all_entries_between_their_neighbours(name: str, size: tuple[int, int] | None) -> None:
    town = load_town(name)
    painter = sheet_painter(town, size)
    width = painter.size[0]
    unit, edge, strip = map_sheet._measures(town, painter.street_names, width)
    surface = pygame.Surface(painter.size)
    place = map_sheet._legend_place(town, unit, width)
    legend = Legend(town, painter.plan, unit)
    title = max(map_sheet._title_width(town, fold, unit, width) for fold in (None, *TownFold))
    left = edge if place.below else edge + title + map_sheet._BESIDE_TITLE * unit
    right = legend.draw(surface, left, 0.0, place.rows)
    limit = width - edge - (0.0 if place.below else map_sheet._WIDEST_SCALE * unit)
    assert right <= limit
    assert strip >= (9.0 + place.height) * unit
    assert len(legend.entries) >= 5


# --- Street names -----------------------------------------------------------------------------------------------------


@cache
def names_of(name: str) -> tuple[MapPainter, FloatingNames]:
    painter = MapPainter(
        load_town(name), size=SIZE, margin=(20, 40, 20, 52), type_sizes=(16, 11), label_spacing=108.0, names_on_top=True
    )
    return painter, FloatingNames(painter.labels, 360.0)


@pytest.mark.parametrize("name", town_names())
def test_every_name_is_shown_and_most_leave_obstacles_free(name: str) -> None:
    _, names = names_of(name)
    alone = names.chosen(SIZE, (), np.zeros(2))
    assert {names.labels[k].text for k in alone} == {label.text for label in names.labels}
    rng = np.random.default_rng(3)
    covered = total = 0
    for _ in range(20):
        obstacles = [(x, y, 26.0, 26.0) for x, y in rng.uniform(20.0, 650.0, (12, 2)).tolist()]
        shown = names.chosen(SIZE, obstacles, np.zeros(2))
        assert {names.labels[k].text for k in shown} == {label.text for label in names.labels}
        for k in shown:
            box = box_around(names.labels[k].path, names.labels[k].half)
            area = sum(overlap(box, other) for other in obstacles)
            others = [j for j, other in enumerate(names.labels) if other.text == names.labels[k].text and j != k]
            boxes = [box_around(names.labels[j].path, names.labels[j].half) for j in others]
            if area:  # no other place of this name is free
                assert all(sum(overlap(each, other) for other in obstacles) for each in boxes)
            covered, total = covered + (area > 0.0), total + 1
    assert covered < 0.2 * total


@pytest.mark.parametrize("follow", [False, True])
def test_names_are_drawn_over_routes_and_not_below_bars_and_marks(follow: bool) -> None:
    town = load_town("brookside")
    lane = town.lanes[25]
    x, y = lane.position(40.0).tolist()
    car = CarView(x=x, y=y, heading=float(lane.heading_at(40.0)))
    trail = np.concatenate([row.points[:, :2] for row in town.lanes if not row.in_junction])
    site = town.sites[3]
    pins = [Pin(label="KFC", x=site.position[0], y=site.position[1], state="pending", waypoint=site.waypoint)]
    view = AerialView(SIZE)
    plain = shown_names(view, Scene(town=town, time=1.0, car=car, landmarks=pins), follow)
    driven = shown_names(view, Scene(town=town, time=1.0, car=car, landmarks=pins, trail=trail), follow)
    assert plain.keys() == driven.keys()
    assert len(plain) > (1 if follow else 8)
    for number, letters in plain.items():
        assert driven[number] > 0.7 * letters > 5


def shown_names(view: AerialView, scene: Scene, follow: bool) -> dict[int, int]:
    """Returns the number of white pixels in the box of each name in a picture, by the numbers of the labels."""
    picture = view.draw(scene, follow)
    painter, names = view._painter(scene, follow)
    centre = painter.to_pixel(np.array([scene.car.x, scene.car.y]))
    corner = np.round(centre - np.array(SIZE) / 2.0) if follow else np.zeros(2)
    canvas = view._canvas
    canvas.begin(painter.scale, painter.origin + corner / painter.scale)
    bar = view._scale_bar
    found = {}
    for number in names.chosen(SIZE, view._kept_free(canvas, scene), corner):
        box = box_around(names.labels[number].path - corner, names.labels[number].half)
        assert overlap(box, bar) == 0.0
        left, top, width, height = (round(part) for part in box)
        pixels = pygame.surfarray.array3d(picture)[left : left + width, top : top + height]
        found[number] = int((pixels.min(axis=-1) > 220).sum())
    return found


def test_a_map_with_names_on_top_has_none_itself() -> None:
    painter, _ = names_of("brookside")
    other = MapPainter(load_town("brookside"), size=SIZE, margin=(20, 40, 20, 52), type_sizes=(16, 11))
    label = other.labels[0]
    left, top, width, height = (round(part) for part in box_around(label.path, label.half))
    without, having = (
        pygame.surfarray.array3d(each.surface())[left : left + width, top : top + height].min(axis=-1)
        for each in (painter, other)
    )
    assert (having > 220).sum() > (without > 220).sum()


@pytest.mark.parametrize("name", ["generated:2,size=large,style=grid", "generated:2,size=large,style=mixed"])
def test_names_on_a_sheet_stay_inside_its_frame(name: str) -> None:
    painter = sheet_painter(load_town(name), (900, 700))
    _, edge, strip = map_sheet._measures(painter.town, painter.street_names, 900)
    for label in painter.labels:
        assert (label.path >= edge).all()
        assert (label.path <= (900 - edge, 700 - strip)).all()
