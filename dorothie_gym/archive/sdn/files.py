"""SDN layouts, and tolerant readers of their JSON and CSV files in bounded memory."""

from __future__ import annotations

import enum
import json
import math
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording.files import MAX_EVENTS, MAX_FRAME, decode_text, read_bytes
from dorothie_gym.support.input_files import LONG_NUMBER, MAX_DEPTH, MAX_DIGITS, check_value_count, raising

if TYPE_CHECKING:
    from dorothie_gym.session.recording.validation import ReadReport

CONFIG_FILE: Final = "config.json"
LOG_FILE: Final = "annotated_log.json"
PLAN_FILE: Final = "plan.json"
DETAILED_PLAN_FILE: Final = "detailed_plan.json"
PLACES_FILE: Final = "trajectory.csv"
AD_WIZARD_FILE: Final = "ad_wizardlog.csv"
GAMELOG_FILE: Final = "gamelog.json"
TASK_FILE: Final = "task.json"
DIALOG_FILE: Final = "dialog_log.json"
SCENE_FILE: Final = "dorothie_gym_scene.parquet"
"""Surroundings of the car, an addition of this package to the layout, in the form of `frames.parquet`."""

OURS: Final = "dorothie_gym"
"""Field of `config.json` and of log rows with the additions of this package."""


MORE: Final = "more"
"""Field of a row, of its act or of its value with further fields of this package's events."""


class SdnLayout(enum.StrEnum):
    """Layout of an SDN session."""

    RELEASE = "release"
    SAMPLE = "sample"
    HUB = "hub"


_LOGS: Final = {SdnLayout.RELEASE: LOG_FILE, SdnLayout.SAMPLE: GAMELOG_FILE, SdnLayout.HUB: DIALOG_FILE}

_FILES: Final = {
    SdnLayout.RELEASE: (CONFIG_FILE, LOG_FILE, PLAN_FILE, DETAILED_PLAN_FILE, PLACES_FILE, AD_WIZARD_FILE, SCENE_FILE),
    SdnLayout.SAMPLE: (CONFIG_FILE, GAMELOG_FILE, TASK_FILE, PLACES_FILE),
    SdnLayout.HUB: (DIALOG_FILE,),
}


def detect_layout(folder: Path) -> SdnLayout | None:
    """Returns the layout of a folder; None without an SDN session."""
    return next((layout for layout, name in _LOGS.items() if (folder / name).is_file()), None)


def log_file(layout: SdnLayout) -> str:
    """Returns the name of the file with the events."""
    return _LOGS[layout]


def expected_files(layout: SdnLayout) -> tuple[str, ...]:
    """Returns the names of the files that are read."""
    return _FILES[layout]


# --- JSON and CSV ----------------------------------------------------------------------------------------------------

JsonObject: TypeAlias = Mapping[str, object]

_SPACE: Final = re.compile(r"[ \t\n\r]*")

APOSTROPHE: Final = "\u2019"
"""Apostrophe in SDN's transcripts."""


def read_json(path: Path, report: ReadReport) -> object:
    """Returns the content of a JSON file; NaN and infinite numbers become null, which is reported.

    For a file with an object on each line, it returns the list of objects.

    Raises:
        SessionError: it is not JSON, or too large, or nested too deeply; the message names the file and the place.
    """
    text = _text(path)
    if not text.strip():
        raise SessionError(f"{path}: is empty")
    if text.lstrip().startswith("["):
        return read_list(path, report, text)
    decode = _Decoder(text, path, report)
    value, place = decode(_skip(text, 0), "")
    place = _skip(text, place)
    if place == len(text):
        return value
    items = [value]
    while place < len(text):
        _check_count(len(items), path)
        item, place = decode(place, f", item {len(items)}")
        items.append(item)
        place = _skip(text, place)
    report.repair(f"{path.name}: a row on each line was read as a list")
    return items


def read_list(path: Path, report: ReadReport, text: str | None = None) -> list[object]:
    """Returns the items of a JSON list in a file, read one by one so that a huge list is rejected early.

    Raises:
        SessionError: as `read_json`, or it holds no list, or more than `MAX_EVENTS` items.
    """
    text = _text(path) if text is None else text
    place = _skip(text, 0)
    if text[place : place + 1] != "[":
        raise SessionError(f"{path}: a JSON list is expected" + ("" if text.strip() else ", the file is empty"))
    items: list[object] = []
    decode = _Decoder(text, path, report)
    place = _skip(text, place + 1)
    while text[place : place + 1] != "]":
        _check_count(len(items), path)
        item, place = decode(place, f", item {len(items)}")
        items.append(item)
        place = _skip(text, place)
        if text[place : place + 1] == ",":
            place = _skip(text, place + 1)
        elif text[place : place + 1] != "]":
            line = text.count("\n", 0, place) + 1
            raise SessionError(f"{path}, line {line}, after item {len(items) - 1}: the list is cut off or damaged")
    if text[place + 1 :].strip():
        report.repair(f"{path.name}: text after the end of the list was left out")
    return items


def _check_count(count: int, path: Path) -> None:
    if count >= MAX_EVENTS:
        raise SessionError(f"{path}: holds more than {MAX_EVENTS} items, which no session does; it is not read")


def read_rows(path: Path, report: ReadReport) -> list[JsonObject]:
    """Returns the objects of a JSON list in a file; other items are left out, which is reported."""
    return objects(read_list(path, report), path.name, report)


def objects(items: list[object], name: str, report: ReadReport) -> list[JsonObject]:
    """Returns the objects among the items; others are left out, which is reported."""
    rows = [item for item in items if isinstance(item, Mapping)]
    report.repair(f"{name}: items that are no objects were left out", len(items) - len(rows))
    return rows


def read_csv(path: Path, limit: int) -> list[list[str]]:
    """Returns the fields of each line, without the spaces around them; empty lines are empty lists.

    Raises:
        SessionError: it is not UTF-8, or too large.
    """
    text = _text(path).replace("\r\n", "\n").replace("\r", "\n").replace("\0", "")
    if text.count("\n") > limit:
        raise SessionError(f"{path}: holds more than {limit} lines, which no session does; it is not read")
    return [[part.strip() for part in line.split(",")] if line.strip() else [] for line in text.split("\n")]


def number_of(value: object) -> float | None:
    """Returns the finite number of a field, given as a number or as text; None without one."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def whole_of(value: object) -> int | None:
    """Returns the whole number of a field, of a magnitude below 2^53; None without one."""
    number = number_of(value)
    return int(number) if number is not None and number == int(number) and abs(number) < 2**53 else None


def frame_of(row: JsonObject) -> int | None:
    """Returns the frame (10 Hz) of a row; None without a valid one."""
    frame = whole_of(row.get("frame"))
    return frame if frame is not None and 0 <= frame < MAX_FRAME else None


def text_of(value: object) -> str:
    """Returns the text of a field; empty without one."""
    return value if isinstance(value, str) else ""


def transcript_of(value: object, report: ReadReport) -> str | None:
    """Returns a transcript with plain apostrophes; None without one."""
    if not isinstance(value, str):
        return None
    if APOSTROPHE in value:
        report.repair("transcripts: U+2019 was read as an apostrophe")
    return str(plain(value.replace(APOSTROPHE, "'").strip()))


def plain(value: object, depth: int = MAX_DEPTH - 8) -> object:
    """Returns a JSON value that a session can hold: texts in UTF-8, finite numbers, bounded nesting."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode("utf-8")
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, list | tuple):
        return [plain(item, depth - 1) for item in value] if depth else "..."
    if isinstance(value, Mapping):
        return plain_object(value, depth) if depth else "..."
    return value


def plain_object(values: JsonObject, depth: int = MAX_DEPTH - 8) -> dict[str, object]:
    """Returns a JSON object that a session can hold; see `plain`."""
    return {str(plain(key)): plain(item, depth - 1) for key, item in values.items()}


def more_of(values: JsonObject) -> dict[str, object]:
    """Returns the fields of events that this package's writer adds to those of the layout."""
    more = values.get(MORE)
    return plain_object(more) if isinstance(more, Mapping) else {}


def _text(path: Path) -> str:
    return decode_text(read_bytes(path), str(path)).removeprefix("\ufeff")


def _skip(text: str, place: int) -> int:
    match = _SPACE.match(text, place)
    return match.end() if match else place


class _Decoder:
    """Decoder of the JSON values in a text; numbers that JSON or a session does not have become null."""

    def __init__(self, text: str, path: Path, report: ReadReport) -> None:
        with raising(SessionError):
            check_value_count(text, path)
        self._text, self._path, self._report = text, path, report
        self._bad: Counter[str] = Counter()
        long = LONG_NUMBER.search(text) is not None
        self._decoder = json.JSONDecoder(parse_constant=self._note, parse_int=self._whole if long else None)

    def __call__(self, place: int, item: str) -> tuple[object, int]:
        """Returns the value at a place, and the place after it; `item` names the value in messages."""
        where = f"{self._path}{item}"
        try:
            value, end = self._decoder.raw_decode(self._text, place)
        except json.JSONDecodeError as error:
            where = f"{self._path}, line {error.lineno}{item}"
            raise SessionError(f"{where}: not JSON ({error.msg}); is the file cut off?") from None
        except RecursionError:
            raise SessionError(f"{where}: the JSON is nested too deeply to be read") from None
        for name, count in self._bad.items():
            self._report.repair(f"{self._path.name}: {name} was read as unknown", count)
        self._bad.clear()
        return value, end

    def _note(self, name: str) -> None:
        self._bad[name] += 1

    def _whole(self, text: str) -> int | None:
        if len(text) <= MAX_DIGITS:
            return int(text)
        self._note(f"a whole number of more than {MAX_DIGITS} digits")
        return None
