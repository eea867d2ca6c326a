"""Compares the two models of perception: the objects that they show, and the outcomes of scripted sessions.

Sessions with the symbolic model are looked at every four seconds: for each object that it shows, whether the picture
also shows it, and otherwise why not. A reason is found by drawing again: the body alone, and all bodies without the
town.
"""

import json
import math
import statistics
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from dorothie_gym.evaluation.analysis.intervals import wilson_interval
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.pictures.camera.camera_perception import CameraPerception
from dorothie_gym.pictures.camera.cells import sorted_by_cell
from dorothie_gym.pictures.camera.mesh import empty_mesh
from dorothie_gym.pictures.camera.pose import pose_on_car
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.scenery.lenses import Lenses
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.pictures.camera.visibility import PERCEPTION_CAMERA, is_body_seen
from dorothie_gym.pictures.chart_style import INK, SHEET, SOFT, empty_figure
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig, PerceptionModel
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT
from dorothie_gym.sim.state.codes import Group
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.world import World
from dorothie_gym.support.compilation.records import plain

EVERY: Final = 8
"""Decisions between two looks."""

BIN: Final = 10.0
"""Width of the classes of distance [m]."""

LAST: Final = round(CLEAR_SIGHT / BIN) - 1
"""Number of the last class, which also has objects that errors of place put beyond `CLEAR_SIGHT`."""

SHOWN: Final = "shown"
REASONS: Final = ("out of frame", "hidden by town", "hidden by a body", "too few pixels", "fog or dark")
COLOURS: Final = ("#2f6f4f", "#c9c4b8", "#8a6d5a", "#c98a4b", "#d9c25a", "#6f88a8")


class Census:
    """Counts, by distance, of the objects that the symbolic model shows, and of their visibility in the picture."""

    def __init__(self, engine: SessionEngine) -> None:
        scene = town_scene(engine.town)
        mesh, cells, _ = sorted_by_cell(empty_mesh())
        none = np.zeros(0, np.int32)
        lenses = Lenses(np.zeros((0, 2), np.int32), none, none)
        empty = replace(scene, mesh=mesh, cells=cells, signals=empty_mesh(), lenses=lenses)
        self._bodies_only = SessionCamera(SessionScene(empty), PERCEPTION_CAMERA)
        self.counts: Counter[tuple[int, str]] = Counter()
        self.seconds = 0.0
        self.looks: list[float] = []
        self._perception: CameraPerception | None = None

    def __call__(self, engine: SessionEngine) -> None:
        """Looks at the present decision, every now and then."""
        begun = time.process_time()
        session = engine.session
        if session.decisions == 0:
            self._perception = CameraPerception(session.world, session.scenario)
        elif session.decisions % EVERY == 0 and self._perception is not None:
            self._perception.look()
            self.looks.append(time.process_time() - begun)
            self._count(self._perception, session.world)
        self.seconds += time.process_time() - begun

    def _count(self, perception: CameraPerception, world: World) -> None:
        count, arrays = len(world.seen()), world.sensing_arrays
        x, y = world.car.position.tolist()
        everybody = None
        for seen in plain(arrays.seen)[:count]:
            key, distance = int(seen["key"]), math.hypot(seen["x"] - x, seen["y"] - y)
            pixels = perception.pixels(key)
            if is_body_seen(pixels, world.visibility.gain(distance)):
                reason = SHOWN
            elif is_body_seen(pixels, 1.0):
                reason = "fog or dark"
            elif not (alone := self._pixels(world, only(arrays, seen["group"], seen["body"])).get(key, 0)):
                reason = "out of frame"
            elif not is_body_seen(alone, 1.0):
                reason = "too few pixels"
            else:
                everybody = everybody or self._pixels(world, arrays)
                hidden = not is_body_seen(everybody.get(key, 0), 1.0)
                reason = "hidden by a body" if hidden else "hidden by town"
            self.counts[min(int(distance / BIN), LAST), reason] += 1

    def _pixels(self, world: World, arrays: WorldArrays) -> dict[int, int]:
        """Returns the visible pixels of bodies by key, without the town."""
        x, y = world.car.position.tolist()
        pose = pose_on_car(PERCEPTION_CAMERA.mount, x, y, float(world.car.height), float(world.car.heading))
        boxes = self._bodies_only.render_from(pose, arrays, world.weather, time=world.time).boxes
        assert boxes is not None
        return dict(zip(boxes.keys.tolist(), boxes.pixels.tolist(), strict=True))


def only(arrays: WorldArrays, group: int, row: int) -> WorldArrays:
    """Returns the arrays with a single body."""
    one = slice(row, row + 1)
    return arrays._replace(
        vehicles=arrays.vehicles[one if group == Group.VEHICLES else slice(0)],
        pedestrians=arrays.pedestrians[one if group == Group.PEDESTRIANS else slice(0)],
        props=arrays.props[one if group == Group.PROPS else slice(0)],
    )


def main(
    towns: Annotated[list[str] | None, typer.Argument(help="names or files of towns")] = None,
    sessions: Annotated[int, typer.Option(min=1, help="sessions in each town with each model")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="seed of the first session")] = 0,
    picture: Annotated[Path | None, typer.Option(help="draw the shares by distance")] = None,
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> None:
    """Prints shares of objects by distance, and success, talk and processor time of the sessions."""
    chosen = towns or ["midtown", "millbrook", "brookside"]
    objects: list[dict[str, object]] = []
    plays: list[dict[str, object]] = []
    with Progress(console=Console(stderr=True), disable=as_json) as progress:
        bar = progress.add_task("sessions", total=2 * sessions * len(chosen))
        for town in chosen:
            found: dict[PerceptionModel, list[dict[str, object]]] = {}
            for model in PerceptionModel:
                engine = SessionEngine(town, config=EnvConfig(perception=model))
                census = Census(engine) if model is PerceptionModel.SYMBOLIC else None
                found[model] = []
                for row in played(engine, range(seed, seed + sessions), census):
                    found[model].append(row)
                    progress.advance(bar)
                if census is not None:
                    objects += object_rows(town, census)
            plays += [summary(town, model, rows) for model, rows in found.items()]
    result = {"sessions_each": sessions, "seed": seed, "sessions": plays, "objects": objects}
    if picture is not None:
        draw(objects, picture)
    if as_json:
        print(json.dumps(result))
        return
    for rows in (plays, objects):
        table = Table(*(str(name).replace("_", " ") for name in rows[0]))
        for each in rows:
            table.add_row(*(str(value) for value in each.values()))
        Console().print(table)


def played(engine: SessionEngine, seeds: Sequence[int], census: Census | None) -> Iterator[dict[str, object]]:
    """Plays scripted sessions; yields the outcome of each."""
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    for seed in seeds:
        before, begun = census.seconds if census else 0.0, time.process_time()
        ending = play_session(engine, policies, seed=seed, on_step=census)
        spent = time.process_time() - begun - (census.seconds - before if census else 0.0)
        perception = engine.session.observer.camera_perception
        landmarks = engine.scenario.storyboard.landmarks
        recognised = () if perception is None else perception.recognised
        yield {
            **ending,
            "processor_seconds": spent,
            "decisions": engine.session.decisions,
            "hidden": sum(landmark.hidden for landmark in landmarks),
            "hidden_recognised": sum(landmarks[index].hidden for index in recognised),
        }


def summary(town: str, model: PerceptionModel, rows: Sequence[dict[str, object]]) -> dict[str, object]:
    """Returns the figures of the sessions of a town with a model; times and talk are means."""

    def mean(name: str) -> float:
        return statistics.fmean(float(str(row[name])) for row in rows)

    wins = sum(bool(row["success"]) for row in rows)
    interval = wilson_interval(wins, len(rows))
    return {
        "town": town,
        "perception": str(model),
        "success": round(wins / len(rows), 3),
        "success_low": round(interval[0], 3),
        "success_high": round(interval[1], 3),
        **{name: round(mean(name), 2) for name in ("seconds", "utterances", "exchanges", "refusals", "collisions")},
        "hidden_landmarks": round(mean("hidden"), 2),
        "hidden_recognised": round(mean("hidden_recognised"), 2),
        "processor_seconds": round(mean("processor_seconds"), 2),
        "milliseconds_per_decision": round(1e3 * mean("processor_seconds") / mean("decisions"), 2),
    }


def object_rows(town: str, census: Census) -> list[dict[str, object]]:
    """Returns a row for each class of distance: the number of objects, and the shares of their visibilities."""
    rows: list[dict[str, object]] = []
    for k in range(LAST + 1):
        count = sum(census.counts[k, what] for what in (SHOWN, *REASONS))
        shares = {
            what.replace(" ", "_"): round(census.counts[k, what] / max(count, 1), 4) for what in (SHOWN, *REASONS)
        }
        rows.append({"town": town, "from": BIN * k, "to": BIN * (k + 1), "objects": count, **shares})
    return rows


def draw(rows: Sequence[dict[str, object]], path: Path) -> None:
    """Draws the shares by distance over all towns as stacked bars: of all objects, and of those in the frame."""
    totals: dict[float, Counter[str]] = {}
    for row in rows:
        counts = totals.setdefault(float(str(row["from"])), Counter())
        for what in (SHOWN, *REASONS):
            counts[what] += round(float(str(row[what.replace(" ", "_")])) * int(str(row["objects"])))
    bins = np.array(sorted(totals))
    with empty_figure(8.0, 3.4) as figure:
        figure.set_layout_engine("constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        for axes, title, parts in (
            (left, "All objects", (SHOWN, *REASONS)),
            (right, "Objects in the frame", (SHOWN, *REASONS[1:])),
        ):
            base = np.zeros(len(bins))
            for what in parts:
                share = np.array([totals[at][what] / max(sum(totals[at][each] for each in parts), 1) for at in bins])
                colour = COLOURS[(SHOWN, *REASONS).index(what)]
                axes.bar(bins + BIN / 2, share, 0.86 * BIN, bottom=base, color=colour, label=what)
                base += share
            axes.set_facecolor(SHEET)
            axes.set_title(title, loc="left", fontsize=10, color=INK)
            axes.set_xlabel("distance [m]", fontsize=9, color=SOFT)
            axes.tick_params(labelsize=8, colors=SOFT, length=0)
            for side in axes.spines.values():
                side.set_visible(False)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, frameon=False, fontsize=8, labelcolor=INK, loc="outside right center")
        figure.savefig(path, dpi=150)


if __name__ == "__main__":
    typer.run(main)
