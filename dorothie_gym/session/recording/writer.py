"""Writer of a session in progress."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import OutputFolderError, SessionError
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.session.recording.action_log import Decision, encode_decision
from dorothie_gym.session.recording.events import Event, encode_event
from dorothie_gym.session.recording.files import (
    ACTIONS_FILE,
    AUDIO_FOLDER,
    EVENTS_FILE,
    FRAMES_FILE,
    HEADER_FILE,
    JOURNAL_FILE,
    MAX_FRAME,
    PICTURES_FOLDER,
    SESSION_FILES,
    canonical_object,
    safe_name,
)
from dorothie_gym.session.recording.frames import ACTORS, CAR, LIGHTS, WEATHER, encode_block, read_journal, write_frames
from dorothie_gym.session.recording.session import SessionFile, picture_name
from dorothie_gym.session.recording.surroundings import ActorColumns, Rows, actor_rows, light_rows, weather_rows
from dorothie_gym.session.recording.trajectory import check_rising, checked_rows
from dorothie_gym.support.files import PART, make_folder, sync, write_atomically

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.recording.header import SessionHeader


LightColours: TypeAlias = Mapping[int, LightColour | str]
"""State of each light, by id of its signal."""

WeatherValues: TypeAlias = Mapping[WeatherParameter, float] | Mapping[str, float]
"""The ten weather parameters, in the ontology's units."""


class Scene(NamedTuple):
    """Surroundings of the car at a frame.

    Attributes:
        actors: rows of `ACTOR_DTYPE`, or a mapping of its columns.
        lights: state of each light.
        weather: the ten weather parameters. Neither mapping may be changed afterwards.
    """

    actors: Rows | ActorColumns
    lights: LightColours
    weather: WeatherValues


class SessionWriter:
    """Appends events and frames to the folder of a session; appended data survives the death of the process.

    At any moment, the folder holds a finished session, an interrupted one that loads up to the last append, or, before
    the header was written, none (`session_state`). A finished session, including pictures and audio, also survives a
    power failure. Actors, lights and weather are optional, at each frame.

    Args:
        folder: folder of the session.
        header: header of the session.
        overwrite: whether an existing session in the folder is deleted.
        create: whether the folder is created if it is missing.

    Raises:
        SessionError: the folder holds a session and `overwrite` is False.
        OutputFolderError: the folder was deleted after the header was written.
        OSError: the folder cannot be written.
    """

    def __init__(
        self, folder: Path | str, header: SessionHeader, *, overwrite: bool = False, create: bool = True
    ) -> None:
        self.folder = Path(folder)
        self.header = header
        self._prepare(overwrite, create)
        SessionFile(header=header).write(self.folder)
        with contextlib.ExitStack() as opened:
            try:
                self._events = opened.enter_context((self.folder / EVENTS_FILE).open("xb"))
                self._journal = opened.enter_context((self.folder / JOURNAL_FILE).open("xb"))
            except FileNotFoundError as error:
                raise OutputFolderError(self._deleted) from error
            opened.pop_all()
        self._decisions: IO[bytes] | None = None
        self._event_count = 0
        self._last_frame = -1
        self._frames: set[float] = set()
        self._lights: tuple[LightColours, Rows] | None = None
        self._weather: tuple[WeatherValues, Rows] | None = None
        self._recorded = {ACTORS: -1, LIGHTS: -1, WEATHER: -1}
        self._last_decision = -1

    def append(
        self,
        events: Iterable[Event] = (),
        frames: NDArray[np.float64] | None = None,
        scene: Scene | None = None,
        *,
        check: bool = True,
    ) -> None:
        """Appends a batch of events and frames and flushes it to the operating system.

        Args:
            events: events, in order.
            frames: (n, 9) float64, see `TRAJECTORY_COLUMNS`; frames must rise.
            scene: surroundings of the car at the last of these frames.
            check: whether the values are checked. Without it they must be those of an engine; the numbers are then
                checked when the session is finished.

        Raises:
            SessionError: an event, a row or the scene cannot be written; no part of the batch is written then.
        """
        self._check_open("nothing can be appended")
        lines = [encode_event(event, check=check) for event in events]
        rows = None if frames is None else self._checked(frames) if check else np.ascontiguousarray(frames)
        parts = () if scene is None else self._parts_of(scene, check)
        if parts and (rows is None or not len(rows)):
            raise SessionError(f"{self.folder}: surroundings without a frame of the car")
        if lines:
            self._events.write(("\n".join(lines) + "\n").encode("utf-8"))
            self._events.flush()
            self._event_count += len(lines)
        if rows is not None and len(rows):
            first, last = int(rows[0, 0]), int(rows[-1, 0])
            self._write((CAR, first, rows), *((kind, last, part) for kind, part in parts))
            self._frames.update(rows[:, 0].tolist())
            self._last_frame = last
            self._recorded.update((kind, last) for kind, _ in parts)

    def add_frames(self, frames: NDArray[np.float64]) -> None:
        """Appends frames of the car, (n, 9) float64 as in `TRAJECTORY_COLUMNS`; raises `SessionError` as `append`."""
        self.append((), frames)

    def add_decision(self, frame: int, actions: Mapping[Role, Mapping[str, object]]) -> None:
        """Appends the actions of the roles at a frame, see `Decision`; nothing is written without an action.

        After the first call, the session counts as one with recorded decisions.

        Raises:
            SessionError: an action cannot be written, or the frame is not above that of the decision before.
        """
        self._check_open("nothing can be appended")
        if frame <= self._last_decision:
            raise SessionError(f"{self.folder}: a decision at frame {frame} after {self._last_decision}")
        line = encode_decision(Decision(frame=frame, actions=actions)) if actions else ""
        if self._decisions is None:
            self._decisions = (self.folder / ACTIONS_FILE).open("xb")
        if line:
            self._decisions.write((line + "\n").encode("utf-8"))
            self._decisions.flush()
        self._last_decision = frame

    def add_actors(self, frame: int, actors: Rows | ActorColumns) -> None:
        """Appends the actors around the car at a frame, as rows of `ACTOR_DTYPE` or as a mapping of its columns.

        Raises:
            SessionError: they have another form, or the frame was not appended before or already has actors.
        """
        self._add(ACTORS, frame, actor_rows(actors))

    def add_lights(self, frame: int, lights: LightColours) -> None:
        """Appends the state of each light at a frame, by id of its signal; raises `SessionError` as `add_actors`."""
        self._add(LIGHTS, frame, self._light_rows(dict(lights)))

    def add_weather(self, frame: int, weather: WeatherValues) -> None:
        """Appends the ten weather parameters at a frame; raises `SessionError` as `add_actors`."""
        self._add(WEATHER, frame, self._weather_rows(dict(weather)))

    def add_picture(self, frame: int, png: bytes) -> None:
        """Writes a picture (PNG) of a frame.

        Raises:
            SessionError: it is not a PNG file, or the frame number is out of range.
        """
        self._check_open("no picture can be added")
        if not png.startswith(b"\x89PNG\r\n\x1a\n"):
            raise SessionError(f"{self.folder}: the picture of frame {frame} is no PNG")
        if not 0 <= frame < MAX_FRAME:
            raise SessionError(f"{self.folder}: a picture of frame {frame}; frames are 0 or above")
        write_atomically(self._subfolder(PICTURES_FOLDER) / picture_name(frame), png)

    def add_audio(self, name: str, flac: bytes) -> None:
        """Writes the audio (FLAC) of a dialogue move, whose field `audio` has the name.

        Raises:
            SessionError: it is not a FLAC file, or the name is that of another kind of file.
        """
        self._check_open("no audio can be added")
        if not flac.startswith(b"fLaC"):
            raise SessionError(f"{self.folder}: the audio {name!r} is no FLAC")
        if safe_name(name) != name or not name.endswith(".flac"):
            raise SessionError(f"{self.folder}: {name!r} is no name of a FLAC file")
        write_atomically(self._subfolder(AUDIO_FOLDER) / name, flac)

    def finish(self, outcome: Mapping[str, object]) -> None:
        """Writes the outcome, which completes the session, and closes it.

        The journal is converted into `frames.parquet` and removed; last, `session.json` is replaced atomically. A
        finished session is on the disk: a power failure cannot destroy parts of it.

        Raises:
            SessionError: the outcome holds other types than JSON's, or the session is closed.
            OutputFolderError: the folder was deleted since the session began.
        """
        self._check_open("it cannot be finished")
        outcome = canonical_object(outcome, "outcome")
        self.close()
        for name in (EVENTS_FILE, ACTIONS_FILE):
            if (self.folder / name).is_file():
                sync(self.folder / name)
        if not (self.folder / JOURNAL_FILE).is_file():
            raise OutputFolderError(self._deleted)
        trajectory, scene = read_journal(self.folder / JOURNAL_FILE)
        write_frames(self.folder / FRAMES_FILE, trajectory, scene)
        (self.folder / JOURNAL_FILE).unlink()
        file = SessionFile(header=self.header, outcome=outcome, events=self._event_count, frames=len(trajectory))
        file.write(self.folder)

    @property
    def _deleted(self) -> str:
        return f"{self.folder}: the folder was deleted or emptied while it was being written"

    def close(self) -> None:
        """Closes the files; an unfinished session stays incomplete. May be called again."""
        with contextlib.ExitStack() as closing:  # all of them, even on a failing disk
            for file in (self._events, self._journal, self._decisions):
                if file is not None:
                    closing.callback(file.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _prepare(self, overwrite: bool, create: bool) -> None:
        if create:
            make_folder(self.folder, parents=True)
        names = (*SESSION_FILES, *(name + PART for name in SESSION_FILES))
        present = [name for name in names if _stands(self.folder / name)]
        if present and not overwrite and present != [HEADER_FILE + PART]:  # that one died before there was a session
            raise SessionError(
                f"{self.folder}: holds a session already ({', '.join(present)}); choose another folder or remove it"
            )
        # The header is removed first: if the process dies after that, the folder holds no session with parts of two.
        for name in present:
            (self.folder / name).unlink()
        for name in (PICTURES_FOLDER, AUDIO_FOLDER):
            if overwrite and (self.folder / name).is_dir():
                shutil.rmtree(self.folder / name)

    def _subfolder(self, name: str) -> Path:
        folder = self.folder / name
        make_folder(folder)
        return folder

    def _check_open(self, consequence: str) -> None:
        if self._events.closed:
            raise SessionError(f"{self.folder}: the session is closed; {consequence}")

    def _checked(self, frames: NDArray[np.float64]) -> NDArray[np.float64]:
        rows = checked_rows(frames)
        check_rising(rows[:, 0], self._last_frame, str(self.folder))
        if len(rows) and rows[-1, 0] >= MAX_FRAME:
            raise SessionError(f"{self.folder}: frame {rows[-1, 0]:.0f}; frames are below {MAX_FRAME}")
        return rows

    def _parts_of(self, scene: Scene, check: bool) -> Sequence[tuple[bytes, Rows]]:
        """Returns the rows of a scene by kind."""
        actors = scene.actors
        return (
            (ACTORS, actor_rows(actors) if check or isinstance(actors, Mapping) else actors),
            (LIGHTS, self._light_rows(scene.lights)),
            (WEATHER, self._weather_rows(scene.weather)),
        )

    def _light_rows(self, lights: LightColours) -> Rows:
        if self._lights is None or (self._lights[0] is not lights and self._lights[0] != lights):  # they rarely change
            self._lights = lights, light_rows(lights)
        return self._lights[1]

    def _weather_rows(self, weather: WeatherValues) -> Rows:
        if self._weather is None or (self._weather[0] is not weather and self._weather[0] != weather):
            self._weather = weather, weather_rows(weather)
        return self._weather[1]

    def _add(self, kind: bytes, frame: int, rows: Rows) -> None:
        self._check_open("nothing can be appended")
        if frame not in self._frames:
            raise SessionError(f"{self.folder}: frame {frame} was not appended; append the frames of the car first")
        if frame <= self._recorded[kind]:
            raise SessionError(f"{self.folder}: frame {frame} after {self._recorded[kind]}; frames must rise")
        self._write((kind, int(frame), rows))
        self._recorded[kind] = int(frame)

    def _write(self, *blocks: tuple[bytes, int, NDArray[np.generic]]) -> None:
        self._journal.write(b"".join([encode_block(*block) for block in blocks]))
        self._journal.flush()


def _stands(path: Path) -> bool:
    """Returns whether a file or link of that name exists, including a broken link."""
    return path.exists() or path.is_symlink()
