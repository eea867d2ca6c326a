import math

import numpy as np
import pytest

from dorothie_gym.baselines.vision.metrics import (
    PictureBoxes,
    PixelScores,
    average_precisions,
    best_threshold,
    box_overlaps,
    place_precision,
    space_errors,
)
from dorothie_gym.ontology import ObjectClass

BOX, FAR = (10.0, 10.0, 20.0, 20.0), (50.0, 50.0, 60.0, 60.0)


CAR = (1.0, 0.5, 20.0, 4.0, 2.0, 1.5, 0.1)  # x, y, z, length, width, height, heading


def boxes(true, detected, scores, kinds=None, detected_kinds=None, ignored=None, spaces=None, detected_spaces=None):
    return PictureBoxes(
        true=np.array(true, float).reshape(-1, 4),
        kinds=np.array(kinds or [0] * len(true), int),
        ignored=np.array(ignored or [False] * len(true), bool),
        detected=np.array(detected, float).reshape(-1, 4),
        detected_kinds=np.array(detected_kinds or [0] * len(detected), int),
        scores=np.array(scores, float),
        spaces=np.array(spaces or [CAR] * len(true), float).reshape(-1, 7),
        detected_spaces=np.array(detected_spaces or [CAR] * len(detected), float).reshape(-1, 7),
    )


def ap50(*pictures):
    return average_precisions(pictures, (0.5,))[0]


def test_intersections_over_union_and_errors_of_depth_of_a_picture_by_hand():
    road, sky, car = (kind.value for kind in (ObjectClass.ROAD, ObjectClass.SKY, ObjectClass.VEHICLES))
    scores = PixelScores()
    depth = np.array([[np.inf, np.inf], [10.0, 100.0]])
    scores.add(np.array([[sky, sky], [road, road]]), np.array([[sky, road], [road, car]]), depth, np.full((2, 2), 12.0))
    assert scores.overlaps == {ObjectClass.ROAD: pytest.approx(1 / 3), ObjectClass.SKY: pytest.approx(1 / 2)}
    figures = scores.figures()
    assert figures["miou"] == pytest.approx((1 / 3 + 1 / 2) / 2)  # no car is present: its false pixel costs the road
    assert figures["macc"] == figures["aacc"] == pytest.approx(0.5)
    assert figures["depth_error"] == pytest.approx(0.2)  # neither the sky nor what is farther than 80 m counts


def test_overlap_of_boxes():
    assert box_overlaps(np.array([BOX]), np.array([BOX, (15.0, 10.0, 25.0, 20.0), FAR]))[0] == pytest.approx(
        [1.0, 1 / 3, 0.0]
    )


def test_found_objects_give_one_and_missed_ones_zero():
    assert ap50(boxes([BOX], [BOX], [0.3])) == 1.0
    assert ap50(boxes([BOX], [FAR], [0.9])) == 0.0
    assert math.isnan(ap50(boxes([], [FAR], [0.9])))


def test_sure_mistake_halves_the_precision_and_unsure_one_costs_nothing():
    assert ap50(boxes([BOX], [FAR, BOX], [0.9, 0.3])) == pytest.approx(0.5)
    assert ap50(boxes([BOX], [FAR, BOX], [0.3, 0.9])) == 1.0


def test_second_detection_of_an_object_is_a_mistake():
    found = ap50(boxes([BOX, FAR], [BOX, BOX, FAR], [0.9, 0.8, 0.7]))
    assert found == pytest.approx((51 * 1.0 + 50 * 2 / 3) / 101)  # recalls up to 0.5 at once, the rest at 2 of 3


def test_half_of_the_objects_gives_half_of_the_recalls():
    assert ap50(boxes([BOX, FAR], [BOX], [0.9])) == pytest.approx(51 / 101)


def test_ignored_object_neither_counts_nor_makes_a_mistake():
    assert ap50(boxes([BOX, FAR], [FAR, BOX], [0.9, 0.5], ignored=[False, True])) == 1.0
    assert ap50(boxes([BOX, FAR], [BOX], [0.5], ignored=[False, True])) == 1.0


def test_box_of_another_kind_is_a_mistake_and_kinds_count_alike():
    assert ap50(boxes([BOX], [BOX], [0.9], detected_kinds=[1])) == 0.0
    assert ap50(boxes([BOX, FAR], [BOX, BOX], [0.9, 0.8], kinds=[0, 1], detected_kinds=[0, 1])) == pytest.approx(0.5)


def test_detections_of_all_pictures_are_ranked_together():
    first, second = boxes([BOX], [BOX], [0.4]), boxes([BOX], [FAR], [0.6])
    assert ap50(first, second) == pytest.approx(51 / 101 / 2)  # the mistake of the other picture comes first


def test_higher_thresholds_demand_closer_boxes():
    close = average_precisions([boxes([BOX], [(10.0, 10.0, 20.0, 17.2)], [0.9])])
    assert close.tolist() == [1.0] * 5 + [0.0] * 5  # an overlap of 0.72


def moved(x=0.0, y=0.0, z=0.0, heading=0.0, longer=1.0):
    return (CAR[0] + x, CAR[1] + y, CAR[2] + z, CAR[3] * longer, CAR[4], CAR[5], CAR[6] + heading)


def test_places_up_to_two_metres_away_are_right_whatever_the_boxes_in_the_picture():
    found = {
        away: place_precision([boxes([BOX], [FAR], [0.9], detected_spaces=[moved(z=away)])]) for away in (1.9, 2.1)
    }
    assert found == {1.9: 1.0, 2.1: 0.0}
    assert (
        place_precision([boxes([BOX], [BOX], [0.9], detected_spaces=[moved(y=5.0)])]) == 1.0
    )  # the height is left out


def test_errors_of_boxes_in_space_are_of_the_detections_that_are_right_in_the_picture():
    picture = boxes(
        [BOX, FAR],
        [BOX, (80.0, 80.0, 90.0, 90.0)],
        [0.9, 0.8],
        detected_spaces=[moved(x=3.0, z=4.0, heading=2.0 * math.pi + 0.5, longer=2.0), moved(x=50.0)],
    )
    found = space_errors([picture], turned=(0,))
    assert found["place_error"] == pytest.approx(5.0) and found["range_error"] == pytest.approx(4.0 / 20.0)
    assert found["size_error"] == pytest.approx(0.5)  # the box is twice as long
    assert found["heading_error"] == pytest.approx(math.degrees(0.5))
    assert found["axis_error"] == found["heading_error"]
    assert math.isnan(space_errors([picture], turned=())["heading_error"])


def test_error_of_the_axis_takes_front_and_back_for_one():
    found = space_errors(
        [boxes([BOX], [BOX], [0.9], detected_spaces=[moved(heading=math.radians(170.0))])], turned=(0,)
    )
    assert found["heading_error"] == pytest.approx(170.0) and found["axis_error"] == pytest.approx(10.0)


def test_errors_without_a_right_detection_are_unknown():
    assert all(math.isnan(error) for error in space_errors([boxes([BOX], [FAR], [0.9])], turned=(0,)).values())
    assert all(math.isnan(error) for error in space_errors([], turned=(0,)).values())


def test_best_threshold_leaves_out_the_unsure_mistakes():
    picture = boxes([BOX, FAR], [BOX, FAR, (80.0, 0.0, 90.0, 9.0), (0.0, 80.0, 9.0, 90.0)], [0.9, 0.4, 0.3, 0.2])
    assert best_threshold([picture]) == (0.4, 1.0)
    missed = boxes([BOX, FAR], [BOX, (80.0, 0.0, 90.0, 9.0)], [0.4, 0.3])
    assert best_threshold([missed]) == (0.4, pytest.approx(2.0 / 3.0))  # one of one, and one of two
    assert best_threshold([boxes([BOX], [FAR], [0.9])]) == (1.0, 0.0)


def test_best_threshold_takes_all_detections_of_a_score():
    picture = boxes([BOX], [BOX, FAR], [0.5, 0.5])
    assert best_threshold([picture]) == (0.5, pytest.approx(2.0 / 3.0))
