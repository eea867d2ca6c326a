from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.archive import ObjectKind, Task
from dorothie_gym.archive.recorded_perception import stop_lines
from dorothie_gym.evaluation.teacher_forced.features import columns_of, gather, points
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import PhysicalAction, WeatherParameter
from dorothie_gym.session.recording import (
    ACTOR_DTYPE,
    LIGHT_DTYPE,
    WEATHER_DTYPE,
    ActorKind,
    SceneTable,
    Session,
    Surroundings,
    trajectory_of,
)
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT
from dorothie_gym.sim.weather import Weather
from tests.session.recording.builders import physical, session


def one_look(rows: object, frame: int = 30) -> SceneTable:
    values = np.atleast_1d(rows)  # type: ignore[call-overload]  # NumPy has no overload for a sequence of records
    return SceneTable(np.array([frame]), np.array([0, len(values)]), values)


def standing(x: float, y: float, heading: float) -> Session:
    """Car that stands still and starts at frame 60."""
    frames = np.arange(90.0)
    rows = np.stack([frames, frames * 0 + x, frames * 0 + y, frames * 0 + heading, *[frames * 0] * 5], axis=1)
    return replace(session([physical(60, PhysicalAction.START)]), trajectory=trajectory_of(rows))


def actor(kind: ActorKind, x: float, y: float, heading: float = 0.0) -> np.ndarray:  # type: ignore[type-arg]  # structured rows
    return np.array([(7, kind, x, y, heading, 3.0, 4.5, 1.8)], dtype=ACTOR_DTYPE)


def now(recorded: Session) -> tuple[list[int], np.ndarray]:  # type: ignore[type-arg]  # structured rows
    columns = columns_of(recorded)
    batch = gather(columns, points(columns, Task.NFD), [0])
    mask = batch.objects_mask[0]
    return batch.kind[0][mask].tolist(), batch.values[0][mask]


def test_objects_are_relative_to_the_car() -> None:
    """The car faces south and y grows southwards, so objects in the east are to its left."""
    scene = Surroundings(
        actors=one_look(
            np.concatenate(
                [actor(ActorKind.PEDESTRIAN, 40.0, 10.0, 0.0), actor(ActorKind.VEHICLE, 10.0, 22.0, math.pi / 2)]
            )
        )
    )
    kinds, values = now(replace(standing(10.0, 10.0, math.pi / 2), scene=scene))
    assert kinds == [ObjectKind.VEHICLE, ObjectKind.PEDESTRIAN], "the nearest first"
    np.testing.assert_allclose(values[0], [12.0, 0.0, 12.0, 0.0, 0.0, 3.0, 4.5, 1.8], atol=1e-5)
    np.testing.assert_allclose(values[1, :5], [30.0, 90.0, 0.0, 30.0, 90.0], atol=1e-5)


def test_only_objects_within_sight_are_perceived() -> None:
    near, far = (
        replace(standing(0.0, 0.0, 0.0), scene=Surroundings(actors=one_look(actor(ActorKind.VEHICLE, x, 0.0))))
        for x in (CLEAR_SIGHT - 0.1, CLEAR_SIGHT + 0.1)
    )
    assert now(near)[0] == [ObjectKind.VEHICLE]
    assert now(far)[0] == []


def test_fog_hides_and_lamps_help_in_the_dark() -> None:
    weather = Weather()
    weather.set(WeatherParameter.SUN_ALTITUDE_ANGLE, -90.0)
    dark, lit = weather.sight(lights=False), weather.sight(lights=True)
    assert dark < lit
    table = one_look(np.array([tuple(weather.values.values())], dtype=WEATHER_DTYPE))
    scene = Surroundings(actors=one_look(actor(ActorKind.PROP, (dark + lit) / 2, 0.0)), weather=table)
    recorded = replace(standing(0.0, 0.0, 0.0), scene=scene)
    assert now(recorded)[0] == []
    switched = physical(3, PhysicalAction.LIGHT_CHANGE, up=True, flagged=False)
    assert now(replace(recorded, events=(switched, *recorded.events)))[0] == [ObjectKind.PROP]


def test_lights_are_perceived_when_the_car_drives_towards_them() -> None:
    town = load_town("brookside")
    signal, (x, y, heading) = next(iter(sorted(stop_lines(town).items())))
    ahead = math.radians(heading)
    lights = one_look(np.array([(signal, 2)], dtype=LIGHT_DTYPE))
    scene = Surroundings(actors=one_look(np.empty(0, dtype=ACTOR_DTYPE)), lights=lights)
    place = x - 20.0 * math.cos(ahead), y - 20.0 * math.sin(ahead)
    towards = replace(standing(*place, ahead), scene=scene)
    towards = replace(towards, header=replace(towards.header, town="brookside"))
    kinds, values = now(towards)
    assert kinds == [ObjectKind.LIGHT_RED]
    np.testing.assert_allclose(values[0, :4], [20.0, 0.0, 20.0, 0.0], atol=0.05)
    away = replace(standing(*place, ahead + math.pi), scene=scene)
    assert now(replace(away, header=towards.header))[0] == []


def test_sessions_without_surroundings_say_so() -> None:
    columns = columns_of(standing(0.0, 0.0, 0.0))
    assert columns.sessions.has_objects.tolist() == [False]
    seen = replace(standing(0.0, 0.0, 0.0), scene=Surroundings(actors=one_look(np.empty(0, dtype=ACTOR_DTYPE))))
    assert columns_of(seen).sessions.has_objects.tolist() == [True]


@pytest.mark.parametrize("frame", [60, 63, 75])
def test_a_look_at_or_after_the_point_is_not_seen(frame: int) -> None:
    scene = Surroundings(actors=one_look(actor(ActorKind.VEHICLE, 5.0, 0.0), frame))
    assert now(replace(standing(0.0, 0.0, 0.0), scene=scene))[0] == []
