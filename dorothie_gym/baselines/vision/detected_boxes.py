"""Objects that a trained detector finds in the pictures of a recorded session, as rows of `ACTOR_DTYPE`.

No data of the recorded actors are used: place, heading and size are those of the box in space, numbers restart in
each picture, and no speed is known, because objects are not tracked from picture to picture.
"""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.trainer import BEST_FILE
from dorothie_gym.baselines.vision.detector import KINDS, Detector
from dorothie_gym.baselines.vision.object_learner import distinct_queries, focals_of
from dorothie_gym.baselines.vision.pixel_learner import predict_pixels
from dorothie_gym.baselines.vision.segformer import SegFormer, normalised
from dorothie_gym.baselines.vision.solids import spaces_of
from dorothie_gym.baselines.vision.trained import load_detector, load_segformer
from dorothie_gym.errors import CheckpointError
from dorothie_gym.evaluation.teacher_forced.features.sight import drawing_digest
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.recording.surroundings import ACTOR_DTYPE, ActorKind, Rows, SceneTable
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.support.files import replacing
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.pose import View
    from dorothie_gym.session.recording.session import Session

CYCLIST_WIDTH: Final = 1.0
"""Width below which a vehicle counts as a cyclist: the detector does not distinguish them [m]."""

OBJECTS_FOLDER: Final = "objects"
"""Folder next to the weights of a detector, with its detections in sessions."""

_SPACING: Final = 4  # records
_AT_ONCE: Final = 8  # pictures
_FORMAT: Final = 1
_KEPT_DTYPE: Final = np.dtype([("record", np.int64), *((name, ACTOR_DTYPE[name]) for name in ACTOR_DTYPE.names or ())])
_ACTORS: Final = {
    ObjectClass.VEHICLES: ActorKind.VEHICLE,
    ObjectClass.PEDESTRIAN: ActorKind.PEDESTRIAN,
    ObjectClass.STATIC: ActorKind.PROP,
}


@dataclass(frozen=True)
class DetectedBoxes:
    """Objects that a trained detector finds, which reads the classes and depths that its SegFormer predicts.

    Detections count above the score that had the best F1 in the validation pictures. The detections in a session are
    stored in a folder next to the weights.

    Attributes:
        detector: folder of its training, `OUT/detr/<size>/seed-<n>`; the SegFormer's is next to it in `OUT`.

    Raises:
        CheckpointError: a training is missing, or the detector reads true classes and depths or those of another
            SegFormer.
    """

    detector: Path

    def __post_init__(self) -> None:
        about = self._about
        if about.get("inputs") != "predicted":
            raise CheckpointError(
                f"{self.detector}: reads true classes and depths; choose a detector trained with --inputs predicted"
            )
        if about.get("segformer") != self._digests[1]:
            raise CheckpointError(f"{self.detector}: was trained with another SegFormer than that in {self.segformer}")

    @property
    def segformer(self) -> Path:
        """Folder of the SegFormer."""
        where = self.detector.absolute()
        return where.parents[2] / "segformer" / where.parent.name / where.name

    @functools.cached_property
    def _about(self) -> dict[str, Any]:
        path = self.detector / BEST_FILE
        if not path.is_file():
            raise CheckpointError(f"{path}: is missing; run first: dorothie-gym train detr, or name its --detector")
        return checkpoints.about(path)

    @functools.cached_property
    def _digests(self) -> tuple[str, str]:
        """Digests of the weights of detector and SegFormer."""
        paths = (self.detector / BEST_FILE, self.segformer / BEST_FILE)
        if not paths[1].is_file():
            raise CheckpointError(f"{paths[1]}: is missing; the detector in {self.detector} reads its predictions")
        return checkpoints.sha256_of(paths[0]), checkpoints.sha256_of(paths[1])

    @property
    def threshold(self) -> float:
        """Minimum score of a detection."""
        figures = self._about.get("figures")
        found = figures.get("threshold") if isinstance(figures, dict) else None
        if not isinstance(found, float):
            raise CheckpointError(f"{self.detector / BEST_FILE}: has no threshold; delete it and train again")
        return found

    @functools.cached_property
    def digest(self) -> str:
        """Digest of the weights and of the source code that draws pictures.

        Raises:
            SessionError: the sources cannot be read.
        """
        return f"detections {_FORMAT} {' '.join(self._digests)} {drawing_digest()} torch {torch.__version__}"

    @functools.cached_property
    def _models(self) -> tuple[SegFormer, Detector]:
        device = torch.device("cpu")
        return load_segformer(self.segformer, device), load_detector(self.detector, device)

    @property
    def query_shape(self) -> tuple[int, int]:
        """Number of queries of the detector, and numbers of each."""
        config = self._models[1].config
        return config.queries, config.size

    def actors(self, session: Session, town: Town) -> SceneTable:
        """Returns the detections in pictures at those of the session's records of actors that are examined.

        That is the last record before each event, which models read at their points, and every fourth of the others,
        for the window before a point. Records outside the frames of the car have no objects.

        Raises:
            SessionError: the session has no frames of the car, or no surroundings.
            OSError: the folder next to the weights cannot be written.
        """
        frames = session.scene.actors.frames
        looks = looked_at(frames, _event_frames(session))
        rows = self._recall(session, town)[0]
        counts = np.bincount(rows["record"], minlength=len(frames))[looks]
        actors = np.empty(len(rows), ACTOR_DTYPE)
        for column in ACTOR_DTYPE.names or ():
            actors[column] = rows[column]
        return SceneTable(frames[looks], np.concatenate(([0], np.cumsum(counts))).astype(np.int64), actors)

    def queries(self, session: Session, town: Town) -> tuple[NDArray[np.int64], NDArray[np.float16]]:
        """Returns the queries (m, q, d) at the last record before each event, and the frames of these records (m,).

        They are 0 outside the frames of the car. Errors as in `actors`.
        """
        frames = session.scene.actors.frames
        return frames[before_events(frames, _event_frames(session))], self._recall(session, town)[1]

    def _recall(self, session: Session, town: Town) -> tuple[Rows, NDArray[np.float16]]:
        """Returns the detections in a session, of `_KEPT_DTYPE`, and its queries; computes them if necessary."""
        name = hashlib.sha256(f"{self.digest} {session.digest} {town.name}".encode()).hexdigest()
        paths = [self.detector / OBJECTS_FOLDER / f"{name}-{part}.npy" for part in ("objects", "queries")]
        rows, queries = (_read(path) for path in paths)
        records = before_events(session.scene.actors.frames, _event_frames(session))
        shape = (len(records), *self.query_shape)
        if rows is None or queries is None or rows.dtype != _KEPT_DTYPE or queries.shape != shape:
            rows, queries = self._look(session, town, records)
            paths[0].parent.mkdir(exist_ok=True)
            for target, values in zip(paths, (rows, queries), strict=True):
                with replacing(target, shared=True) as path, path.open("wb") as file:
                    np.save(file, values, allow_pickle=False)
        return rows, queries

    def _look(
        self, session: Session, town: Town, queried: NDArray[np.int64]
    ) -> tuple[NDArray[np.void], NDArray[np.float16]]:
        """Returns the detections in a session, and the queries at some of its records, in ascending order."""
        config = self._models[1].config
        camera = CameraConfig(width=config.width, height=config.height, outputs=(CameraOutput.RGB,))
        pictures = RecordedPictures(session, town, camera)
        frames = session.scene.actors.frames
        looks = looked_at(frames, _event_frames(session))
        inside = looks[(frames[looks] >= pictures.first_frame) & (frames[looks] <= pictures.last_frame)]
        found, queries = [np.empty(0, _KEPT_DTYPE)], np.zeros((len(queried), *self.query_shape), np.float16)
        threads = torch.get_num_threads()
        torch.set_num_threads(1)  # equal weights find equal objects, regardless of the number of processors
        try:
            for records in np.array_split(inside, max(math.ceil(len(inside) / _AT_ONCE), 1)):
                if len(records):
                    rows, vectors = self._found_at(records.tolist(), pictures, frames)
                    found += rows
                    wanted = np.isin(records, queried)
                    queries[np.searchsorted(queried, records[wanted])] = vectors[wanted]
        finally:
            torch.set_num_threads(threads)
        return np.concatenate(found), queries

    def _found_at(
        self, records: Sequence[int], pictures: RecordedPictures, frames: NDArray[np.int64]
    ) -> tuple[list[Rows], NDArray[np.float16]]:
        """Returns the detections in the pictures of records, each of `_KEPT_DTYPE`, and the queries (n, q, d)."""
        reader, detector = self._models
        drawn, views = [], []
        for record in records:
            picture = pictures.picture(int(frames[record]))
            drawn.append(picture.colours.copy())
            views.append(picture.view)
        rgb = np.stack(drawn)
        semantic, depth = predict_pixels(reader, rgb)
        depth = depth.astype(np.float16).astype(np.float32)  # as in training
        with torch.inference_mode():
            found = detector(
                normalised(torch.from_numpy(rgb)), torch.from_numpy(depth), torch.from_numpy(semantic).long()
            )
        kept = []
        spaces = spaces_of(found.solids.numpy(), focals_of(detector.config))
        for k, (record, view) in enumerate(zip(records, views, strict=True)):
            heading = pictures.pose(int(frames[record])).heading
            rows = objects_in(found.boxes[k].numpy(), found.scores[k].numpy(), self.threshold)
            actors = actors_at(found.scores[k].numpy()[rows], spaces[k, rows], view, heading)
            table = np.empty(len(actors), _KEPT_DTYPE)
            table["record"] = record
            for column in ACTOR_DTYPE.names or ():
                table[column] = actors[column]
            kept.append(table)
        return kept, found.queries.numpy().astype(np.float16)


def before_events(records: NDArray[np.int64], events: NDArray[np.int64]) -> NDArray[np.int64]:
    """Returns the places (n,) of the last records before the tenths of a second of events, ascending.

    Args:
        records: (k,) frames of the records, ascending.
        events: frames of the session's events.
    """
    last = np.searchsorted(records // FRAMES_PER_TENTH, events // FRAMES_PER_TENTH) - 1
    return np.unique(last[last >= 0])


def looked_at(records: NDArray[np.int64], events: NDArray[np.int64]) -> NDArray[np.int64]:
    """Returns the ascending indices (n,) of the records that are examined; arguments as in `before_events`."""
    return np.union1d(before_events(records, events), np.arange(0, len(records), _SPACING)).astype(np.int64)


def _event_frames(session: Session) -> NDArray[np.int64]:
    return np.array([event.frame for event in session.events], dtype=np.int64)


def objects_in(boxes: NDArray[np.floating], scores: NDArray[np.floating], threshold: float) -> NDArray[np.int64]:
    """Returns the queries (n,) that are objects in a picture, in order of confidence, each object once.

    Args:
        boxes: (q, 4) centre x and y, width and height.
        scores: (q, k) sureness of the kinds.
        threshold: minimum score of an object.
    """
    sure = np.flatnonzero(scores.max(axis=1) >= threshold)
    return sure[distinct_queries(boxes[sure], scores[sure])] if len(sure) else sure


def actors_at(scores: NDArray[np.floating], spaces: NDArray[np.float64], view: View, heading: float) -> Rows:
    """Returns objects in a picture as rows of `ACTOR_DTYPE`, in the same order.

    Args:
        scores: (n, k) sureness of the kinds of each.
        spaces: (n, 7) boxes in space, `SPACE_COLUMNS`.
        view: projection of the picture.
        heading: heading of the camera [rad].
    """
    aside, down, ahead, length, width, _, turned = spaces.T
    places = view.origin + np.stack((aside, -down, ahead), axis=1) @ view.axes
    rows = np.zeros(len(scores), ACTOR_DTYPE)
    rows["key"] = np.arange(1, len(scores) + 1)
    rows["kind"] = np.array([_ACTORS[kind].value for kind in KINDS])[scores.argmax(axis=1)]
    rows["kind"][(rows["kind"] == ActorKind.VEHICLE) & (width < CYCLIST_WIDTH)] = ActorKind.CYCLIST
    rows["x"], rows["y"] = places[:, 0], places[:, 1]
    rows["heading"] = wrap_radians(turned + heading)
    rows["length"], rows["width"] = length, width
    return rows


def _read(path: Path) -> Any:
    """Returns the array in a file; None if it is missing or damaged."""
    try:
        return np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
