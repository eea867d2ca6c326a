"""Small SDN sessions of the three layouts, made from their description; the words are ours."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

FIRST = 1200
"""Frame (10 Hz) at which the sessions begin."""


def landmark(name: str, x: float, y: float, **changes: Any) -> dict[str, Any]:
    return {
        "asset": name.lower(),
        "name": name,
        "is_hidden": False,
        "wp": {
            "Transform": {"Location": {"x": x, "y": y, "z": 0.1}, "Rotation": {"pitch": 0, "yaw": 90.0, "roll": 0}},
            "OpenDriveID": {"lane_id": -1, "road_id": 4, "junction_id": -1},
        },
        **changes,
    }


def config(**changes: Any) -> dict[str, Any]:
    environment = {
        "map": "Town97",
        "street_names": ["Baits", "Fuller"],
        "departure": {"road": 3},
        "landmarks": [landmark("KFC", 5.0, 60.0), landmark("Seven Eleven", 0.0, 9.0, is_hidden=True)],
    }
    rest = {"start_frame": FIRST, "end_frame": FIRST + 300, "weather": {"wetness": 3.0}, "npc_count": 12}
    return {"environment": environment, **rest, **changes}


def move(frame: int, speaker: str, text: str, kind: str, slots: Any = None, **changes: Any) -> dict[str, Any]:
    row = {
        "frame": FIRST + frame,
        "type": "DialogueMove",
        "from": speaker,
        "to": "wizard" if speaker == "dorothy" else "dorothy",
        "flag": True,
        "utterance_gt": text,
        "utterance": text.lower(),
        "act": {"move": kind, "slots": slots or {}, "exchange": 1},
    }
    return {**row, **changes}


def deed(frame: int, act: str, slot_type: Any = None, slot_val: Any = None, **changes: Any) -> dict[str, Any]:
    val = {"act": act, "slot_type": slot_type, "slot_val": slot_val}
    row = {"frame": FIRST + frame, "type": "PhysicalAction", "from": "wizard", "to": "", "flag": True, "val": val}
    return {**row, **changes}


def belief(frame: int, act: str, slot_val: Any) -> dict[str, Any]:
    return deed(frame, act, "x", slot_val, type="BeliefUpdate", flag=False)


def speech(first: int, last: int, speaker: str, number: int) -> list[dict[str, Any]]:
    return [
        {
            "frame": FIRST + frame,
            "type": "Speech",
            "from": speaker,
            "utterance_filename": f"utterance_{number}.flac",
            "start_frame": FIRST + first,
            "end_frame": FIRST + last,
        }
        for frame in range(first, last + 1)
    ]


def log() -> list[dict[str, Any]]:
    """Six moves of five utterances, six actions, four beliefs, speech; not in order of frames."""
    return [
        *speech(10, 22, "dorothy", 0),
        move(22, "dorothy", "Please drive up to the chicken place.", "Instruct", {"Landmark": ["KFC"]}),
        deed(30, "Start"),
        move(28, "wizard", "Sure, it\u2019s noted.", "Acknowledge"),
        move(28, "wizard", "Sure, it\u2019s noted.", "Explain", {"Status": ["Ongoing"]}),
        belief(25, "GoalUpdate", ["KFC"]),
        belief(26, "PlanUpdate", [7, 9]),
        belief(200, "StatusUpdate", ["KFC", "Completed"]),
        belief(210, "LandmarkUpdate", [3.5, -2.0]),
        deed(60, "Jturn", "Angle", 90.0, type="PhysicalAction  "),
        deed(140, "LaneSwitch", "Direction", 2),
        deed(150, "LaneSwitch", "Direction", 3),
        deed(160, "SpeedChange", "Speed", -5),
        deed(170, "LightChange", "Light", "On"),
        move(180, "dorothy", "A van stands there.", "Explain", {"Object": ["Vehicle"], "StreetName": ["Fuller"]}),
        deed(190, "Stop", **{"from": "planner", "flag": False}),
        move(195, "dorothy", "No, not yet.", "ReplyN", {"Status": ["Completed"]}),
    ]


def drive(turn: float = -90.0) -> list[tuple[Any, ...]]:
    """East, through junction 7 with a turn of `turn` degrees to the right, and on: 300 rows."""
    rows = []
    x = y = yaw = 0.0
    for frame in range(300):
        if 80 <= frame < 110:
            yaw += turn / 30
        x, y = x + 0.6 * math.cos(math.radians(yaw)), y + 0.6 * math.sin(math.radians(yaw))
        junction = 7 if 78 <= frame < 112 else -1
        rows.append((FIRST + frame, round(x, 4), round(y, 4), round(yaw, 4), junction, 4 if frame < 80 else 5, -1))
    return rows


HEADER = "frame, x, y, yaw, junction_id, road_id, lane_id"


def csv(rows: Sequence[Sequence[Any]], header: str = HEADER) -> str:
    return "\n".join([header, *(", ".join(map(str, row)) for row in rows)]) + "\n"


PLAN = [
    {"frame": FIRST + 20, "landmark": "KFC", "status": "Ongoing"},
    {"frame": FIRST + 200, "landmark": "KFC", "status": "Completed"},
]
DETAILED_PLAN = [
    {"frame": FIRST + 25, "junctions": None, "objective": ["KFC"]},
    {"frame": FIRST + 120, "junctions": [9], "objective": None},
]
AD_WIZARD = [
    "16:00:01, 1250, set_weather, fog_density, 80.0",
    "16:00:02, 1260, prop_create, static.prop.streetbarrier, 44, 10.0, 20.0, 0.1, 0, 90, 0",
    "16:00:03, 1270, make_peds, 5, -10, 10, -20, 20",
    "16:00:04, 1280, make_cars, 3, 0, 1, 2, 3",
    "16:00:05, 1290, message, Your friend calls, buy milk.",
    "16:00:06, 1299, camera_shake, 3",
]


def release(folder: Path, **files: Any) -> Path:
    """A session of the release layout; `files` replaces files, None leaves one out."""
    content: dict[str, Any] = {
        "config.json": config(),
        "annotated_log.json": log(),
        "plan.json": PLAN,
        "detailed_plan.json": DETAILED_PLAN,
        "trajectory.csv": csv(drive()),
        "ad_wizardlog.csv": "\n".join(AD_WIZARD) + "\n",
        "carlalog.log": "binary",
    }
    return _write(folder, content, files)


def sample_log() -> list[dict[str, Any]]:
    def said(frame: int, speaker: str, text: str, act: str, **val: Any) -> dict[str, Any]:
        marks = {
            "is_sog": False,
            "is_eog": False,
            "is_sot": False,
            "is_eot": False,
            "slot_type": None,
            "slot_val": None,
        }
        val = {"utterance": text, "act": act, **marks, **val}
        return {"frame": frame, "from": speaker, "to": "wizard", "type": "dialogue", "val": val}

    def done(frame: int, kind: str, act: str, slot_type: Any = None, slot_val: Any = None) -> dict[str, Any]:
        val = {"act": act, "slot_type": slot_type, "slot_val": slot_val}
        return {"frame": frame, "from": "wizard", "to": "planner", "type": kind, "val": val}

    return [
        said(90, "wizard", "Fine.", "Acknowledge", is_eog=True),
        said(
            80,
            "dorothy",
            "Turn into Fuller.",
            "Instruct",
            is_sog=True,
            is_sot=True,
            slot_type="Street",
            slot_val="Fuller",
        ),
        done(95, "physical", "JTurn", "RoadID", 5),
        done(85, "planning", "GoalUpdate", "Landmark", "KFC"),
        said(120, "dorothy", "Nice weather.", "Irrelevant", is_eot=True),
        done(100, "physical", "Start"),
    ]


def sample(folder: Path, **files: Any) -> Path:
    marks = [
        {"name": "KFC", "location": [5.0, 60.0, 0.1], "rotation": [0, 90, 0], "s": 12.5, "road_id": 4, "lane_id": -1},
        {"name": "House", "location": [9.0, 1.0, 0.1], "rotation": [0, 0, 0], "s": 2.0, "road_id": 5, "lane_id": 1},
    ]
    content: dict[str, Any] = {
        "config.json": {"environment": {**config()["environment"], "landmarks": marks}, "task": {"subgoals": []}},
        "task.json": {
            "template": "errand",
            "assignments": {"FOOD": "KFC", "HOME": "House"},
            "story": "Eat, then go home.",
            "subgoals": [
                {"destination": "$FOOD", "description": "Eat."},
                {"destination": "$HOME", "description": "Rest.", "delete": True},
            ],
            "hidden_from_wizard": ["HOME"],
        },
        "gamelog.json": sample_log(),
        "gamelog.csv": "frame\n",
        "trajectory.csv": csv([(frame - FIRST, *rest) for frame, *rest in drive()]),
    }
    return _write(folder, content, files)


def hub(folder: Path, value: Any = None) -> Path:
    return _write(folder, {"dialog_log.json": log() if value is None else value, "carlalog.log": "binary"}, {})


def _write(folder: Path, content: dict[str, Any], files: dict[str, Any]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    given = {name.replace("__", "."): value for name, value in files.items()}
    for name, value in {**content, **given}.items():
        if isinstance(value, bytes):
            (folder / name).write_bytes(value)
        elif value is not None:
            text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
            (folder / name).write_text(text, encoding="utf-8")
    return folder


def edited(change: Callable[[list[dict[str, Any]]], None]) -> list[dict[str, Any]]:
    """The log after a change."""
    rows = log()
    change(rows)
    return rows
