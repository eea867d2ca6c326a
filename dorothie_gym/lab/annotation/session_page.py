"""A session as the browser tool shows it: dialogue without labels, events, the car and bodies, pictures, sound."""

from __future__ import annotations

import io
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image

from dorothie_gym.archive.sdn.audio import AUDIO_FOLDERS
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.analysis.transcript import description_of
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.session.recording.surroundings import ActorKind
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.input_files import read_file

if TYPE_CHECKING:
    from dorothie_gym.lab.annotation.source_text import SourceLine, SourceText
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
    from dorothie_gym.session.recording.session import Session

POSE_STEP: Final = 6
"""Frames between two poses that a browser receives: 5 a second."""

WINDOW: Final = 300
"""Frames whose bodies are sent at once: 10 s."""

PICTURE_SIZE: Final = (480, 270)
"""Size of pictures through the windscreen [px]."""

PICTURE_QUALITY: Final = 80

MAX_AUDIO: Final = 16 * 2**20
"""Largest audio file of an utterance that is sent [bytes]."""

_KINDS: Final = {
    int(ActorKind.VEHICLE): ObjectClass.VEHICLES.label,
    int(ActorKind.CYCLIST): ObjectClass.VEHICLES.label,
    int(ActorKind.PEDESTRIAN): ObjectClass.PEDESTRIAN.label,
    int(ActorKind.PROP): "prop",
    int(ActorKind.OTHER): "prop",
}


class SessionPage:
    """Session for browsers. Methods may be called from several threads.

    Args:
        session: the session.
        text: its text.
        folder: its folder, where sessions of SDN have their audio; None without one.
        maps: folder with maps of towns that are not shipped.

    Attributes:
        session: see above.
        town: town of the session; None if it is not known, and then there is neither a map nor pictures.
    """

    def __init__(
        self, session: Session, text: SourceText, folder: Path | None = None, maps: Path | None = None
    ) -> None:
        self.session, self._text = session, text
        self._audio = dict(session.audio) or _audio_files(session, folder)
        self.town: Town | None = find_town(session.header.town, maps)
        self._pictures: RecordedPictures | None = None
        self._lock = threading.Lock()

    def content(self) -> dict[str, Any]:
        """Returns the data that do not depend on an annotator, in JSON types, without labels of the dialogue."""
        header, session = self.session.header, self.session
        return {
            "name": session.name,
            "town": None if self.town is None else self.town.name,
            "seconds": round(session.duration, 2),
            "streets": list(header.street_names),
            "landmarks": [[row["name"], round(row["x"], 1), round(row["y"], 1)] for row in header.landmarks],
            "hidden": [row["hidden"] for row in header.landmarks],
            "story": header.story,
            "errands": [row["description"] for row in header.subgoals],
            "utterances": [self._line(line) for line in self._text.lines],
            "events": [
                [round(event.time, 2), event.type.value, event.source.value, words]
                for event in session.events
                if event.type is not EventType.DIALOGUE_MOVE and (words := description_of(event, session))
            ],
            "poses": self._poses(),
            "pictures": self.town is not None and bool(len(session.trajectory)) and bool(len(session.scene.actors)),
        }

    def _line(self, line: SourceLine) -> dict[str, Any]:
        return {
            "speaker": line.id.speaker.value,
            "utterance": line.id.number,
            "words": list(line.words),
            "start": round(line.start, 3),
            "end": round(line.end, 3),
            "audio": self.audio_names(line),
        }

    def audio_names(self, line: SourceLine) -> list[str]:
        """Returns the audio files of an utterance, in the order of its words."""
        names = [
            event.data.get("audio")
            for event in self.session.of_type(EventType.DIALOGUE_MOVE)
            if event.source is line.id.speaker and event.data.get("utterance") == line.id.number
        ]
        return list(dict.fromkeys(name for name in names if isinstance(name, str) and name in self._audio))

    def _poses(self) -> list[list[float]]:
        """Returns time [s], x, y [m], heading [rad] and speed [km/h] of the car."""
        rows = self.session.trajectory[::POSE_STEP]
        speed = np.nan_to_num(rows["speed"]) * 3.6
        columns = (rows["frame"] / FRAME_RATE, rows["x"], rows["y"], rows["heading"], speed)
        table: list[list[float]] = np.round(np.column_stack(columns), 2).tolist()
        return table

    def bodies(self, frame: int) -> list[list[Any]]:
        """Returns the bodies around the car in the window that begins at a frame.

        Returns:
            A row for each recorded frame: its time [s], and for each body kind, x, y [m], heading [rad], length and
            width [m].
        """
        table = self.session.scene.actors
        first, last = np.searchsorted(table.frames, (frame, frame + WINDOW)).tolist()
        found = []
        for k in range(first, last):
            rows = table.rows[table.offsets[k] : table.offsets[k + 1]]
            bodies = [
                [_KINDS.get(int(row["kind"]), "prop"), *(round(float(row[name]), 2) for name in _PLACE)] for row in rows
            ]
            found.append([round(int(table.frames[k]) / FRAME_RATE, 2), bodies])
        return found

    def picture(self, frame: int) -> bytes:
        """Returns the picture through the windscreen at a frame as JPEG; the first one builds the scene of the town.

        Raises:
            SessionError: the session has no frames or no surroundings, or its town is not known.
        """
        from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
        from dorothie_gym.session.config import CameraConfig

        if self.town is None:
            raise SessionError(f"{self.session.name}: its town {self.session.header.town!r} is not known; give --maps")
        with self._lock:  # the camera has buffers
            if self._pictures is None:
                width, height = PICTURE_SIZE
                self._pictures = RecordedPictures(self.session, self.town, CameraConfig(width=width, height=height))
            rgb = self._pictures.picture(frame).rgb
        assert rgb is not None
        file = io.BytesIO()
        Image.fromarray(rgb).save(file, format="JPEG", quality=PICTURE_QUALITY)
        return file.getvalue()

    def audio(self, name: str) -> bytes:
        """Returns an audio file of the session.

        Raises:
            SessionError: there is no such file.
            OSError: it cannot be read.
        """
        path = self._audio.get(name)
        if path is None:
            raise SessionError(f"{self.session.name}: has no audio of this name")
        return read_file(path, MAX_AUDIO)


_AUDIO_ENDINGS: Final = (".flac", ".wav")
_PLACE: Final = ("x", "y", "heading", "length", "width")


def _audio_files(session: Session, folder: Path | None) -> dict[str, Path]:
    """Returns the audio files of a session of SDN, by the names in its dialogue moves."""
    if folder is None:
        return {}
    names = {str(event.data.get("audio")) for event in session.of_type(EventType.DIALOGUE_MOVE)}
    plain = [name for name in names if Path(name).name == name and Path(name).suffix in _AUDIO_ENDINGS]
    places = [(name, folder / inner / name) for name in plain for inner in AUDIO_FOLDERS]
    return {name: path for name, path in places if path.is_file()}
