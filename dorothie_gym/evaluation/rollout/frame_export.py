"""Frames of recorded sessions as files: pictures, and labels for vision models.

A folder for each session holds `rgb/000123.png` and the like by frame (30 Hz), and `annotations.json` in COCO's format.
In SDN's layout pictures are `rgba/41.jpg` by the corpus's frames (10 Hz).
"""

from __future__ import annotations

import functools
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dorothie_gym.archive.corpus import Corpus, CorpusEntry
from dorothie_gym.archive.sdn.writer import first_frame_of
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.evaluation.rollout.replay import ReplaySources
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass
from dorothie_gym.ontology.spellings import parse_landmark
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.recording.session import Session
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.copying import shared
from dorothie_gym.support.files import PART, write_atomically

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame

Page: TypeAlias = dict[str, Any]
"""Object of JSON."""

ANNOTATIONS: Final = "annotations.json"
"""File of the annotations of a session; it is written last."""

DEPTH_UNIT: Final = 256.0
"""Steps of the depth in a file for a metre, as in KITTI; 0 is the sky, 65535 anything farther than 255.99 m."""

LANDMARK_CATEGORY: Final = 100
"""Category of a landmark less the id of its name; other categories are ids of `ObjectClass`."""

_INSTANCES = 1 << 24  # numbers of instances that a file can hold, as in COCO's panoptic format
_PARTS = 16  # tasks of an export of one session
_JPEG_QUALITY = 92


class FrameLayout(StrEnum):
    """Layout of the files."""

    NATIVE = "native"
    """`rgb/000123.png` by frames (30 Hz)."""
    SDN = "sdn"
    """`rgba/41.jpg` by SDN's frames (10 Hz)."""


WRITTEN_OUTPUTS: Final = (
    CameraOutput.RGB,
    CameraOutput.DEPTH,
    CameraOutput.SEMANTIC,
    CameraOutput.INSTANCE,
    CameraOutput.BOXES,
)
"""Outputs that have files."""


@shared
@dataclass(frozen=True, kw_only=True)
class FrameExport:
    """Settings of an export.

    Attributes:
        rate: pictures for a second of a session [1/s].
        camera: settings of the camera, with the outputs that are written; `CameraOutput.BOXES` are annotations.
        layout: names of the files.

    Raises:
        ValueError: the rate is out of its range, or an output has no files.
    """

    rate: float = 2.0
    camera: CameraConfig = field(default_factory=lambda: CameraConfig(outputs=WRITTEN_OUTPUTS))
    layout: FrameLayout = FrameLayout.NATIVE

    def __post_init__(self) -> None:
        most = 10.0 if self.layout is FrameLayout.SDN else float(FRAME_RATE)
        if not 0.01 <= self.rate <= most:
            raise ValueError(f"FrameExport.rate is {self.rate:g}; it must be in 0.01..{most:g} in this layout")
        for output in self.camera.outputs:
            if output not in WRITTEN_OUTPUTS:
                raise ValueError(
                    f"FrameExport.camera.outputs contains {output.value!r}; it must be of {', '.join(WRITTEN_OUTPUTS)}"
                )

    def to_json(self) -> Page:
        """Returns the settings in JSON types."""
        camera, mount = self.camera, self.camera.mount
        sideways = {name: getattr(mount, name) for name in ("right", "yaw", "roll") if getattr(mount, name)}
        return {
            "rate": self.rate,
            "width": camera.width,
            "height": camera.height,
            "field_of_view": camera.field_of_view,
            "outputs": sorted(output.value for output in camera.outputs),
            "antialiasing": camera.antialiasing,
            "shadows": camera.shadows,
            "layout": self.layout.value,
            "mount": {"forward": mount.forward, "up": mount.up, "pitch": mount.pitch} | sideways,
        }


@dataclass(frozen=True, kw_only=True)
class ExportedSession:
    """Frames of a session.

    Attributes:
        session: its name.
        folder: where they are.
        pictures: number of pictures.
        annotations: number of boxes.
        new: whether they were written now.
    """

    session: str
    folder: Path
    pictures: int
    annotations: int
    new: bool


def export_frames(
    corpus: Corpus,
    out: Path,
    export: FrameExport,
    sources: ReplaySources,
    *,
    workers: int = 1,
    on_part: Callable[[int, int], None] | None = None,
) -> list[ExportedSession]:
    """Writes the frames of sessions, each into the folder of its path in the corpus; of a single one into `out`.

    The folder of a session appears when it is complete; an interrupted export continues with the next session. The
    bytes do not depend on the number of processes.

    Args:
        corpus: the sessions.
        out: folder to write.
        export: settings.
        sources: maps of towns that are not shipped.
        workers: number of processes.
        on_part: called with the number of parts that are done and of all.

    Raises:
        SessionError: a folder contains other files, or a session has no surroundings or no known town.
        OSError: a file cannot be written.
        ProcessError: a process died.
    """
    found, jobs = [], []
    for entry in corpus.entries:
        is_one = entry.path == corpus.root
        folder = out if is_one else out / entry.path.relative_to(corpus.root)
        done = _finished(folder, export)
        if done is None:
            jobs.append(_Job(entry, folder, export, sources))
        else:
            found.append(done)
    parts = -(-_PARTS // len(jobs)) if jobs else 1
    tasks = [_Part(job, number, parts) for job in jobs for number in range(parts)]
    try:
        for job in jobs:
            job.begin()
        drawn: dict[Path, dict[int, _Drawn]] = {}
        for count, part in enumerate(run_tasks(_prepare, tasks, workers=workers), start=1):
            own = drawn.setdefault(part.job.folder, {})
            own[part.number] = part
            if len(own) == parts:
                found.append(part.job.finish([own[number] for number in range(parts)]))
                del drawn[part.job.folder]
            if on_part is not None:
                on_part(count, len(tasks))
    finally:
        for job in jobs:
            shutil.rmtree(job.part, ignore_errors=True)
    return sorted(found, key=lambda each: str(each.folder))


def _finished(folder: Path, export: FrameExport) -> ExportedSession | None:
    """Returns the result of an earlier export with these settings; None if there is nothing yet."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return None
    try:
        page = json.loads((folder / ANNOTATIONS).read_text(encoding="utf-8"))
        info = page["info"]
        if info["export"] == export.to_json():
            return ExportedSession(
                session=info["session"],
                folder=folder,
                pictures=len(page["images"]),
                annotations=len(page["annotations"]),
                new=False,
            )
        reason = "holds frames with other settings"
    except (OSError, ValueError, KeyError, TypeError):
        reason = "exists and holds something else"
    raise SessionError(f"{folder}: {reason}; choose another folder, or remove it first")


# --- One session ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Job:
    """Export of a session into a folder, first into a hidden one next to it."""

    entry: CorpusEntry
    folder: Path
    export: FrameExport
    sources: ReplaySources

    @property
    def part(self) -> Path:
        return self.folder.with_name(f".{self.folder.name[:80]}{PART}")

    def begin(self) -> None:
        shutil.rmtree(self.part, ignore_errors=True)

    def finish(self, parts: Sequence[_Drawn]) -> ExportedSession:
        """Writes the annotations, and gives the folder its name."""
        images = [image for part in parts for image in part.images]
        annotations = [row for part in parts for row in part.annotations]
        for number, row in enumerate(annotations, start=1):
            row["id"] = number
        page: Page = {
            "info": {**parts[0].info, "export": self.export.to_json()},
            "images": images,
            "categories": categories(),
            "annotations": annotations,
        }
        write_atomically(self.part / ANNOTATIONS, json.dumps(page, allow_nan=False, separators=(",", ":")) + "\n")
        if self.folder.is_dir():
            self.folder.rmdir()  # an empty one, which was checked
        self.part.rename(self.folder)
        return ExportedSession(
            session=page["info"]["session"],
            folder=self.folder,
            pictures=len(images),
            annotations=len(annotations),
            new=True,
        )


@dataclass(frozen=True)
class _Part:
    """Part of the frames of a session: `number` of `count`."""

    job: _Job
    number: int
    count: int

    def __str__(self) -> str:
        return str(self.job.entry.path)


@dataclass(frozen=True)
class _Drawn:
    """Annotations of a part of the pictures."""

    job: _Job
    number: int
    info: Page
    images: list[Page]
    annotations: list[Page]


def _prepare() -> Callable[[_Part], _Drawn]:
    return functools.partial(_draw, functools.lru_cache(maxsize=1)(_open))


_Opened: TypeAlias = tuple[Session, RecordedPictures]


def _open(entry: CorpusEntry, export: FrameExport, sources: ReplaySources) -> _Opened:
    outputs = set(export.camera.outputs)
    if CameraOutput.BOXES in outputs:
        outputs |= {CameraOutput.SEMANTIC, CameraOutput.INSTANCE}
    session = entry.load()
    camera = replace(export.camera, outputs=tuple(output for output in CameraOutput if output in outputs))
    return session, RecordedPictures(session, sources.town_of(session), camera)


def _draw(opened: Callable[[CorpusEntry, FrameExport, ReplaySources], _Opened], part: _Part) -> _Drawn:
    """Writes the files of a part."""
    job = part.job
    session, pictures = opened(job.entry, job.export, job.sources)
    frames = pictures.frames(job.export.rate)
    chosen = frames[len(frames) * part.number // part.count : len(frames) * (part.number + 1) // part.count]
    files = _Files(job, session)
    images, annotations = [], []
    for frame in chosen:
        picture = pictures.picture(frame)
        images.append(_image(picture, frame, pictures, files))
        if CameraOutput.BOXES in job.export.camera.outputs:
            annotations += list(_boxes(picture, frame, pictures, session))
    info = {"session": session.name, "town": session.header.town, "source": session.header.source, **_UNITS}
    return _Drawn(job, part.number, info, images, annotations)


_UNITS: Page = {
    "depth": "metres = value / 256; 0 is the sky, 65535 is 256 m and more",
    "semantic": "value = category of CARLA",
    "instance": "number = R + 256 G + 65536 B; 0 is none, landmarks count down from 16777215",
    "box_3d": "centre [m], length, width and height [m], heading [rad] in the town: x east, y south, z up",
}


class _Files:
    """Names and contents of the files of a session."""

    def __init__(self, job: _Job, session: Session) -> None:
        self._folder, self._outputs, self._layout = job.part, job.export.camera.outputs, job.export.layout
        self._first = first_frame_of(session.header)

    def number(self, frame: int) -> str:
        if self._layout is FrameLayout.SDN:
            return str(self._first + round(frame * 10 / FRAME_RATE))
        return f"{frame:06d}"

    def write(self, picture: CameraFrame, frame: int) -> dict[str, str]:
        """Writes the pictures of a frame; returns their paths by the fields of an image in the annotations."""
        names, written = self.number(frame), {}
        for output, name, content in self._contents(picture):
            path = f"{name}/{names}{'.jpg' if name == 'rgba' else '.png'}"
            target = self._folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            if name == "rgba":
                content.save(target, quality=_JPEG_QUALITY)
            else:
                content.save(target, compress_level=3)
            written["file_name" if output is CameraOutput.RGB else f"{output}_file_name"] = path
        return written

    def _contents(self, picture: CameraFrame) -> Iterator[tuple[CameraOutput, str, Image.Image]]:
        if CameraOutput.RGB in self._outputs and picture.rgb is not None:
            yield CameraOutput.RGB, "rgba" if self._layout is FrameLayout.SDN else "rgb", Image.fromarray(picture.rgb)
        if CameraOutput.DEPTH in self._outputs and picture.depth is not None:
            yield CameraOutput.DEPTH, "depth", Image.fromarray(encoded_depth(picture.depth))
        if CameraOutput.SEMANTIC in self._outputs and picture.semantic is not None:
            yield CameraOutput.SEMANTIC, "semantic", Image.fromarray(picture.semantic)
        if CameraOutput.INSTANCE in self._outputs and picture.instance is not None:
            yield CameraOutput.INSTANCE, "instance", Image.fromarray(encoded_instances(picture.instance))


def encoded_depth(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Returns depths (h, w) [m] as they are in files, see `DEPTH_UNIT`."""
    steps = np.rint(np.where(np.isfinite(depth), depth, 0.0) * DEPTH_UNIT)
    near = np.clip(steps, 1, np.iinfo(np.uint16).max)
    return np.where(np.isfinite(depth), near, 0).astype(np.uint16)


def encoded_instances(keys: NDArray[np.int32]) -> NDArray[np.uint8]:
    """Returns keys of bodies and landmarks (h, w) as colours (h, w, 3) of COCO's panoptic format.

    Raises:
        SessionError: a key is larger than a file can hold.
    """
    if keys.max(initial=0) >= _INSTANCES // 2:
        raise SessionError(f"instance {keys.max()} is larger than {_INSTANCES // 2 - 1}, the most that a file can hold")
    numbers = keys.astype(np.int64) % _INSTANCES
    return np.stack((numbers % 256, numbers // 256 % 256, numbers // 65536), axis=-1).astype(np.uint8)


# --- Annotations in COCO's format -------------------------------------------------------------------------------------


def categories() -> list[Page]:
    """Returns the categories: CARLA's classes, and the landmarks by name."""
    classes = [
        {"id": kind.value, "name": kind.label, "supercategory": "class"}
        for kind in ObjectClass
        if kind not in (ObjectClass.UNLABELED, ObjectClass.QUERIED)
    ]
    landmarks = [
        {"id": LANDMARK_CATEGORY + name.value, "name": name.label, "supercategory": "landmark"}
        for name in LandmarkName
        if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED)
    ]
    return classes + landmarks


def _image(picture: CameraFrame, frame: int, pictures: RecordedPictures, files: _Files) -> Page:
    view, pose = picture.view, pictures.pose(frame)
    right, up, ahead = view.axes.tolist()
    return {
        "id": frame,
        **files.write(picture, frame),
        "width": view.width,
        "height": view.height,
        "frame": frame,
        "time": round(frame / FRAME_RATE, 4),
        "camera": {
            "intrinsics": [[view.focal, 0.0, view.width / 2], [0.0, view.focal, view.height / 2], [0.0, 0.0, 1.0]],
            "position": view.origin.tolist(),
            "rotation": [right, [-each for each in up], ahead],  # rows: to the right, down and forward
            "heading": pose.heading,
            "pitch": pose.pitch,
        },
    }


def _boxes(picture: CameraFrame, frame: int, pictures: RecordedPictures, session: Session) -> Iterator[Page]:
    """Yields the boxes of a picture, by ascending keys, without their ids."""
    boxes, semantic, instance = picture.bodies, picture.classes, picture.keys
    solid = pictures.solid_boxes(frame)
    rows = {key: row for row, key in enumerate(solid.keys.tolist())}
    for key, (left, top, right, bottom), pixels in zip(
        boxes.keys.tolist(), boxes.limits.tolist(), boxes.pixels.tolist(), strict=True
    ):
        inside = (slice(top, bottom), slice(left, right))
        page: Page = {
            "id": 0,
            "image_id": frame,
            "category_id": _category(key, semantic[inside][instance[inside] == key], session),
            "bbox": [left, top, right - left, bottom - top],
            "area": pixels,
            "iscrowd": 0,
            "instance": key % _INSTANCES,
        }
        if key in rows:
            row = rows[key]
            page["box_3d"] = {
                "centre": _rounded(solid.centres[row]),
                "size": _rounded(solid.sizes[row]),
                "heading": round(float(solid.headings[row]), 6),
            }
        yield page


def _category(key: int, classes: NDArray[np.uint8], session: Session) -> int:
    if key < 0:
        return LANDMARK_CATEGORY + int(parse_landmark(session.header.landmarks[-1 - key]["name"]).value)
    return int(np.bincount(classes).argmax())


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [round(value, 4) for value in values.tolist()]
