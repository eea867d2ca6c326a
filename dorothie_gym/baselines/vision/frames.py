"""Labelled pictures of the recorded sessions of a corpus, drawn once and kept in the user's cache.

An entry of the cache is a folder of memory-mapped `.npy` files for one session. Its name is a hash of all that
determines its content: the session, its town, the sampling, and the source of the renderer. Entries are sealed; damaged
ones are drawn again. The least recently used entries are removed beyond `MOST_BYTES`.
"""

from __future__ import annotations

import functools
import hashlib
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.corpus import Corpus, CorpusEntry
from dorothie_gym.errors import OntologyError, SessionError
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.maps.cache import pack, package_sources
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology.spellings import parse_sensor
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.pictures.camera.array_cache import builder_digest
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.support.files import PART
from dorothie_gym.support.input_files import MIB
from dorothie_gym.support.portable_math import wrap_radians
from dorothie_gym.support.user_cache import (
    cache_folder,
    discard,
    is_sealed,
    make_private,
    mark_used,
    remove,
    remove_least_used,
    seal,
)

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.pictures.camera.solid_boxes import SolidBoxes
    from dorothie_gym.session.recording.session import Session

OnFrames: TypeAlias = Callable[[int, int], None]
"""Called with the numbers of finished and of all sessions."""

CLASSES: Final = 23
"""Number of CARLA's semantic classes, `ObjectClass` without QUERIED."""

SPACE_COLUMNS: Final = ("x", "y", "z", "length", "width", "height", "heading")
"""Columns of a body's upright box in space: centre to the right, down and along the axis of the camera, size [m], and
heading relative to the camera's, clockwise from above [rad]."""

BOX_DTYPE: Final = np.dtype(
    [(name, np.int32) for name in ("picture", "kind", "left", "top", "right", "bottom", "pixels")]
    + [(name, np.float32) for name in SPACE_COLUMNS]
)
"""Number of the picture in its session, `ObjectClass`, limits one past the last pixel, visible pixels, box in space."""

CAMERA_FAULTS: Final = tuple(sensor for sensor in Sensor if CLARITY[sensor] < 1.0)
"""Faults that show in pictures."""

MOST_BYTES: Final = 8 * 1024 * MIB
"""Limit of the pictures in the user's cache [bytes]; those of the running command are kept even beyond it."""

_NEAR: Final = 45.0  # [m] farther road users have few pixels
_TRIED: Final = 2  # pictures that are looked at for one that is chosen
_FORMAT: Final = 2
_OUTPUTS: Final = (
    CameraOutput.RGB,
    CameraOutput.DEPTH,
    CameraOutput.SEMANTIC,
    CameraOutput.INSTANCE,
    CameraOutput.BOXES,
)


@dataclass(frozen=True, kw_only=True)
class FrameSampling:
    """Choice of pictures of a session, and their size. Pictures of a faulty camera are left out.

    Attributes:
        width: width of a picture [pixels].
        height: height of a picture [pixels].
        spacing: distance that the car drives between two pictures [m].
        wait: time after which a car that does not drive gives a further picture [s].
        most: maximum number of pictures of a session, evenly thinned out.
        pixels: visible pixels that at least one road user or prop in a picture has; 0 for any picture.

    Raises:
        ValueError: a field is out of its range; the message names it.
    """

    width: int = 320
    height: int = 192
    spacing: float = 8.0
    wait: float = 15.0
    most: int = 100
    pixels: int = 0

    def __post_init__(self) -> None:
        if min(self.width, self.height) < 32 or self.width % 32 or self.height % 32:
            raise ValueError(f"FrameSampling: {self.width}x{self.height} pixels must be multiples of 32")
        if self.most < 1 or self.pixels < 0:
            raise ValueError(f"FrameSampling: most {self.most} must be at least 1, pixels {self.pixels} at least 0")
        if not (self.spacing > 0.0 and self.wait > 0.0):
            raise ValueError(f"FrameSampling: spacing {self.spacing} m and wait {self.wait} s must be positive")

    @property
    def camera(self) -> CameraConfig:
        """Camera of the pictures."""
        return CameraConfig(width=self.width, height=self.height, outputs=_OUTPUTS)

    def candidates(self, session: Session) -> NDArray[np.int64]:
        """Returns the frames (n,) of a session at places that are apart, ascending."""
        rows = session.trajectory
        faults = _camera_faults(session)
        chosen: list[int] = []
        last = -1
        for k in range(0, len(rows), FRAME_RATE // 10):
            frame = int(rows["frame"][k])
            if last >= 0:
                away = np.hypot(rows["x"][k] - rows["x"][last], rows["y"][k] - rows["y"][last])
                if away < self.spacing and frame - rows["frame"][last] < self.wait * FRAME_RATE:
                    continue
            if not any(first <= frame <= end for first, end in faults):
                last = k
                chosen.append(frame)
        return np.array(chosen, dtype=np.int64)

    def choose(self, session: Session, town: Town) -> NDArray[np.int64]:
        """Returns the chosen frames (n,) of a session, rising."""
        chosen = self.candidates(session)
        if self.pixels:
            chosen = _thinned(chosen[[_faces_actor(session, frame) for frame in chosen.tolist()]], _TRIED * self.most)
        if self.pixels and len(chosen):
            camera = CameraConfig(width=self.width, height=self.height, outputs=(CameraOutput.BOXES,))
            pictures = RecordedPictures(session, town, camera)
            chosen = chosen[[_most_pixels(pictures.picture(frame)) >= self.pixels for frame in chosen.tolist()]]
        return _thinned(chosen, self.most)


def _thinned(frames: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Returns at most a given number of frames, evenly chosen."""
    count = min(len(frames), most)
    return frames[np.arange(count) * len(frames) // max(count, 1)]


def _faces_actor(session: Session, frame: int) -> bool:
    """Returns whether the record has an actor near the car and ahead of it, which may be hidden."""
    actors = session.scene.actors.at(frame)
    rows = session.trajectory
    car = rows[np.searchsorted(rows["frame"], frame)]
    if actors is None:
        return False
    dx, dy = actors["x"] - car["x"], actors["y"] - car["y"]
    ahead = np.cos(car["heading"]) * dx + np.sin(car["heading"]) * dy
    aside = np.cos(car["heading"]) * dy - np.sin(car["heading"]) * dx
    return bool(((ahead > 2.0) & (ahead < _NEAR) & (np.abs(aside) < ahead)).any())


def _camera_faults(session: Session) -> list[tuple[int, int]]:
    """Returns first and last frame of each time in which the camera is faulty."""
    faults, begun = [], dict[Sensor, int]()
    for event in session.of_type(EventType.EXCEPTION):
        try:
            sensor = parse_sensor(str(event.data.get("sensor")))
        except OntologyError:
            continue  # an exception of another kind
        if sensor not in CAMERA_FAULTS:
            continue
        if event.data.get("on"):
            begun.setdefault(sensor, event.frame)
        elif sensor in begun:
            faults.append((begun.pop(sensor), event.frame))
    return faults + [(frame, sys.maxsize) for frame in begun.values()]


def _most_pixels(drawn: CameraFrame) -> int:
    """Returns the visible pixels of the largest road user or prop in a picture."""
    return int(drawn.bodies.pixels[drawn.bodies.keys > 0].max(initial=0))


@dataclass(frozen=True, eq=False)
class SessionFrames:
    """Labelled pictures of a session.

    Attributes:
        name: name of the session.
        town: name of its town.
        key: hash of all that determines the pictures.
        rgb: (n, h, w, 3) uint8.
        semantic: (n, h, w) uint8 `ObjectClass`.
        depth: (n, h, w) float16 distance along the axis of the camera [m], infinite for the sky.
        boxes: (m,) of `BOX_DTYPE`, by ascending picture: road users and props, in the picture and in space.
        frames: (n,) int64 frames of the session (30 Hz).
    """

    name: str
    town: str
    key: str
    rgb: NDArray[np.uint8]
    semantic: NDArray[np.uint8]
    depth: NDArray[np.float16]
    boxes: NDArray[np.void]
    frames: NDArray[np.int64]

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self.frames)

    def boxes_of(self, picture: int) -> NDArray[np.void]:
        """Returns the boxes of a picture."""
        first, last = np.searchsorted(self.boxes["picture"], (picture, picture + 1))
        return self.boxes[first:last]


@dataclass(frozen=True, eq=False)
class Pictures:
    """Batch of labelled pictures.

    Attributes:
        rgb: (b, h, w, 3) uint8.
        semantic: (b, h, w) uint8.
        depth: (b, h, w) float16 [m].
        boxes: boxes of each picture, of `BOX_DTYPE`.
    """

    rgb: NDArray[np.uint8]
    semantic: NDArray[np.uint8]
    depth: NDArray[np.float16]
    boxes: Sequence[NDArray[np.void]]


class FrameSet:
    """Labelled pictures of several sessions, one after another.

    Attributes:
        sessions: their sessions.
    """

    def __init__(self, sessions: Sequence[SessionFrames]) -> None:
        self.sessions = tuple(sessions)
        self._ends = np.cumsum([0, *(len(session) for session in self.sessions)])[1:]

    def __len__(self) -> int:
        """Number of pictures."""
        return int(self._ends[-1]) if len(self._ends) else 0

    def take(self, rows: Sequence[int]) -> Pictures:
        """Returns the pictures at the given positions."""
        places = [self._place(row) for row in rows]
        return Pictures(
            np.stack([session.rgb[k] for session, k in places]),
            np.stack([session.semantic[k] for session, k in places]),
            np.stack([session.depth[k] for session, k in places]),
            [session.boxes_of(k) for session, k in places],
        )

    def _place(self, row: int) -> tuple[SessionFrames, int]:
        number = int(np.searchsorted(self._ends, row, side="right"))
        return self.sessions[number], row - (int(self._ends[number - 1]) if number else 0)

    @functools.cached_property
    def pixel_counts(self) -> NDArray[np.int64]:
        """Number of pixels of each class (23,)."""
        counts = np.zeros(CLASSES, dtype=np.int64)
        for session in self.sessions:
            for picture in session.semantic:
                counts += np.bincount(picture.ravel(), minlength=CLASSES)
        return counts

    @property
    def key(self) -> str:
        """Hash of all that determines the pictures."""
        return hashlib.sha256(" ".join(session.key for session in self.sessions).encode()).hexdigest()


def load_frames(
    corpus: Corpus,
    sampling: FrameSampling,
    *,
    workers: int = 1,
    folder: Path | None = None,
    on_session: OnFrames = lambda done, planned: None,
) -> dict[str, FrameSet]:
    """Returns the labelled pictures of a corpus by fold, drawn now if they are not in the cache.

    Args:
        corpus: the corpus.
        sampling: choice of pictures.
        workers: number of processes that draw.
        folder: where entries are kept, without a limit; by default `frames` in the user's cache.
        on_session: called with the numbers of finished and of all sessions.

    Raises:
        SessionError: a session cannot be read, has no recorded surroundings, or its town is unknown; or the cache is
            switched off and no folder is given.
        OSError: an entry cannot be written.
    """
    bounded = folder is None
    if folder is None:
        cache = cache_folder()
        if cache is None:
            raise SessionError("pictures for training need the user's cache: set DOROTHIE_GYM_CACHE to a folder")
        folder, keys = cache / "frames", cache
        make_private(folder)
    else:
        keys = folder
        folder.mkdir(parents=True, exist_ok=True)
    entries = [entry for entry in corpus.entries if entry.fold is not None]
    tasks = [(number, entry, sampling, folder, keys) for number, entry in enumerate(entries)]
    found: dict[int, SessionFrames] = {}
    on_session(0, len(tasks))
    for number, path, name, town in run_tasks(_prepare, tasks, workers=max(min(workers, len(tasks)), 1)):
        found[number] = _mapped(path, name, town)
        on_session(len(found), len(tasks))
    if bounded:
        remove_least_used(folder, MOST_BYTES, {session.key for session in found.values()})
    folds: dict[str, list[SessionFrames]] = {}
    for number, entry in enumerate(entries):
        folds.setdefault(str(entry.fold), []).append(found[number])
    return {fold: FrameSet(sessions) for fold, sessions in folds.items()}


_Task: TypeAlias = tuple[int, CorpusEntry, FrameSampling, Path, Path]
_Drawn: TypeAlias = tuple[int, Path, str, str]


def _prepare() -> Callable[[_Task], _Drawn]:
    return _draw


def _draw(task: _Task) -> _Drawn:
    """Draws the pictures of a session unless they are kept; returns number, folder, name and town."""
    number, entry, sampling, folder, keys = task
    session = entry.load()
    town = find_town(session.header.town, entry.maps)
    if town is None:
        raise SessionError(f"{session.name}: its town {session.header.town} is unknown; give its map")
    key = hashlib.sha256(f"{_builder_digest()} {session.digest} {sampling}\n".encode() + pack(town, "")).hexdigest()
    target = folder / key
    if not is_sealed(target, keys):
        if target.exists():
            discard(target, "it does not fit its seal")
        pictures = RecordedPictures(session, town, sampling.camera)
        _write(target, pictures, sampling.choose(session, town), sampling, keys)
    mark_used(target)
    return number, target, session.name, town.name


def _write(
    target: Path, pictures: RecordedPictures, frames: NDArray[np.int64], sampling: FrameSampling, keys: Path
) -> None:
    """Draws pictures into a new folder, which is renamed and sealed with the key in `keys` when it is complete."""
    size = len(frames), sampling.height, sampling.width
    part = Path(tempfile.mkdtemp(prefix=f"{target.name[:16]}.", suffix=PART, dir=target.parent))
    try:
        rgb: Any = np.lib.format.open_memmap(part / "rgb.npy", mode="w+", dtype=np.uint8, shape=(*size, 3))
        semantic: Any = np.lib.format.open_memmap(part / "semantic.npy", mode="w+", dtype=np.uint8, shape=size)
        depth: Any = np.lib.format.open_memmap(part / "depth.npy", mode="w+", dtype=np.float16, shape=size)
        boxes = [np.empty(0, BOX_DTYPE)]
        for k, frame in enumerate(frames.tolist()):
            drawn = pictures.picture(frame)
            rgb[k], semantic[k], depth[k] = drawn.rgb, drawn.semantic, drawn.depth
            boxes.append(_boxes(k, drawn, pictures.solid_boxes(frame), pictures.pose(frame).heading))
        del rgb, semantic, depth  # writes them
        np.save(part / "boxes.npy", np.concatenate(boxes), allow_pickle=False)
        np.save(part / "frames.npy", frames, allow_pickle=False)
        seal(part, target.name, keys)
        remove(target)  # of a process that was faster
        part.rename(target)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _boxes(number: int, drawn: CameraFrame, solid: SolidBoxes, heading: float) -> NDArray[np.void]:
    """Returns the boxes of road users and props in a picture; the class is the commonest of their pixels.

    Args:
        number: number of the picture.
        drawn: the picture.
        solid: boxes in space of the bodies near the camera.
        heading: heading of the camera [rad].
    """
    places = {key: place for place, key in enumerate(solid.keys.tolist())}
    middles = (solid.centres - drawn.view.origin) @ drawn.view.axes.T  # right, up, ahead
    chosen = np.flatnonzero(drawn.bodies.keys > 0)  # landmarks have negative keys
    rows = np.zeros(len(chosen), BOX_DTYPE)
    for place, k in enumerate(chosen.tolist()):
        left, top, right, bottom = drawn.bodies.limits[k].tolist()
        inside = drawn.keys[top:bottom, left:right] == drawn.bodies.keys[k]
        kind = int(np.bincount(drawn.classes[top:bottom, left:right][inside]).argmax())
        body = places[int(drawn.bodies.keys[k])]
        aside, up, ahead = middles[body].tolist()
        turned = wrap_radians(float(solid.headings[body]) - heading)
        rows[place] = (
            number, kind, left, top, right, bottom, int(drawn.bodies.pixels[k]), aside, -up, ahead,
            *solid.sizes[body].tolist(), turned,
        )  # fmt: skip
    return rows


def _mapped(path: Path, name: str, town: str) -> SessionFrames:
    """Returns the pictures in a folder."""
    rgb, semantic, depth = (
        np.load(path / f"{part}.npy", mmap_mode="r", allow_pickle=False) for part in ("rgb", "semantic", "depth")
    )
    boxes, frames = (np.load(path / f"{part}.npy", allow_pickle=False) for part in ("boxes", "frames"))
    return SessionFrames(name, town, path.name, rgb, semantic, depth, boxes, frames)


@functools.cache
def _builder_digest() -> str:
    """Returns a digest of all that determines the pictures of a session except the session itself."""
    scenes = builder_digest()
    if scenes is None:
        raise SessionError("the sources of the camera cannot be read; no pictures can be kept for the training")
    digest = hashlib.sha256(f"{_FORMAT} {scenes} {np.__version__}\n".encode())
    for name, text in package_sources("dorothie_gym.archive"):
        digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest()
