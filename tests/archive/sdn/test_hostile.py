"""Damaged and malicious files give one clear error, or a reported repair."""

from __future__ import annotations

import json
import os
import resource
import time
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.archive.sdn import read_sdn
from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording import Session
from dorothie_gym.session.recording.files import MAX_EVENTS
from tests.archive.sdn.builders import (
    FIRST,
    HEADER,
    config,
    csv,
    deed,
    drive,
    edited,
    hub,
    log,
    move,
    release,
    sample,
)

TEXT = json.dumps(log())


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"annotated_log__json": TEXT[: len(TEXT) // 2]}, r"annotated_log.json, line 1, item \d+: not JSON"),
        ({"annotated_log__json": TEXT[:-1]}, r"annotated_log.json, line 1, after item \d+: the list is cut off"),
        ({"annotated_log__json": ""}, "annotated_log.json: is empty"),
        ({"annotated_log__json": {"a": 1}}, "annotated_log.json: holds no list of events"),
        ({"annotated_log__json": "7"}, "annotated_log.json: a JSON list of events is expected"),
        ({"annotated_log__json": TEXT.encode("utf-16")}, "annotated_log.json: not UTF-8 at byte 0"),
        ({"annotated_log__json": TEXT.encode().replace(b"chicken", b"chick\xe9n")}, "not UTF-8 at byte"),
        ({"annotated_log__json": "[" * 100_000}, "annotated_log.json, item 0: the JSON is nested too deeply"),
        ({"config__json": "[1]"}, "config.json: a JSON object is expected"),
        ({"config__json": '{"environment": '}, "config.json, line 1: not JSON .*cut off"),
        ({"plan__json": '{"frame": 1}'}, "plan.json: a JSON list is expected"),
        ({"trajectory__csv": "1, 2, 3\n"}, r"trajectory.csv, line 1: the columns are '1, 2, 3'; 'frame' is missing"),
        ({"trajectory__csv": b"frame, x, y, yaw\n\xff"}, "trajectory.csv: not UTF-8"),
    ],
)
def test_unreadable_files_are_reported_with_name_and_place(tmp_path: Path, files: Any, message: str) -> None:
    with pytest.raises(SessionError, match=message):
        read_sdn(release(tmp_path / "log_1", **files))


def test_rows_of_wrong_types_are_left_out_or_kept_and_counted(tmp_path: Path) -> None:
    wrong: list[Any] = [
        7, None, "row", [], {}, {"frame": "x", "type": "Speech"}, {"frame": -3, "type": "Speech"}, {"frame": 1e300},
        {"frame": FIRST, "type": 5}, {"frame": True, "type": "Speech"},
        move(1, "dorothy", "Ok.", "Instruct", act=[1]), move(1, "dorothy", "Ok.", "Instruct", {"Landmark": 3}),
        move(1, "dorothy", "Ok.", "Instruct", {"Landmark": {"a": 1}}), move(1, "dorothy", "Ok.", "Instruct", [3]),
        deed(2, "JTurn", "Angle", {"a": 1}), deed(2, "JTurn", "Angle", "12.5"), deed(2, "JTurn", "Angle", 1e308),
        deed(2, "JTurn", "RoadID", None), deed(3, "Stop", val=None), deed(3, "LightChange", "x", [1]),
        deed(4, "PlanUpdate", "x", {"a": 2}, type="BeliefUpdate"), {**deed(5, "Stop"), "from": 3},
        {**deed(6, "Stop"), "dorothie_gym": 1}, {**deed(6, "Stop"), "dorothie_gym": {"extra": 3}, "val": 3},
    ]  # fmt: skip
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=[*log(), *wrong]))
    assert session.report.repaired["annotated_log.json: items that are no objects were left out"] == 4
    assert session.report.repaired["annotated_log.json: rows without a frame or a type were left out"] == 6
    assert len(session.moves()) >= 5
    assert Session.load(session.save(tmp_path / "native")).events == session.events


def test_numbers_that_are_none_are_read_as_unknown(tmp_path: Path) -> None:
    rows = [deed(5, "JTurn", "Angle", float("nan")), deed(6, "SpeedChange", "Speed", float("-inf"))]
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=json.dumps(rows)))
    assert [(a.angle, a.up) for a in session.physical_actions] == [(None, None), (None, None)]
    assert session.report.repaired["annotated_log.json: NaN was read as unknown"] == 1
    assert session.report.repaired["annotated_log.json: -Infinity was read as unknown"] == 1


def test_trajectory_ends_at_its_second_header(tmp_path: Path) -> None:
    text = csv(drive()[:50]) + csv(drive()[100:])
    session = read_sdn(release(tmp_path / "log_1", trajectory__csv=text))
    assert session.trajectory["frame"].tolist() == list(range(0, 150, 3))
    repair = "trajectory.csv: ends at a second header (line 52); 200 lines after it were left out"
    assert session.report.repaired[repair] == 1


def test_faults_of_the_trajectory_are_repaired_and_reported(tmp_path: Path) -> None:
    rows = [",".join(map(str, row)) for row in drive()]
    rows[10], rows[20] = rows[20], rows[10]
    rows[30] = rows[29]
    rows[40] = f"{FIRST + 40}, nan, 3, 4, -1, 5, -1"
    rows[50] = f"{FIRST + 50}, 1"
    rows[60] = "x, 1, 2, 3, 4, 5, 6"
    rows[70] = f"{FIRST + 70}.5, 1, 2, 3, 4, 5, 6"
    session = read_sdn(release(tmp_path / "log_1", trajectory__csv="\n\n".join(["\ufeff" + HEADER, *rows])))
    repaired = session.report.repaired
    assert repaired["trajectory.csv: rows without frame or place were left out"] == 4
    assert repaired["trajectory.csv: rows were out of order by frame, and were put in order"] == 1
    assert repaired["trajectory.csv: of several rows of a frame the first was taken"] == 1
    frames = session.trajectory["frame"] // 3
    assert frames.tolist() == [k for k in range(300) if k not in (30, 40, 50, 60, 70)]


def test_trajectory_may_have_other_columns_and_lack_numbers_of_roads(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1", trajectory__csv="frame,x,y,yaw,z\n1200,1,2,3,4.5\n1201,1,2,3,\n"))
    assert session.report.unknown["trajectory.csv: column 'z'"] == 1
    assert session.report.missing["trajectory.csv: column 'road_id'"] == 1
    assert session.scene.columns["z"][0] == 4.5
    assert Session.load(session.save(tmp_path / "native")).digest == session.digest


@pytest.mark.parametrize("row", ["{}", json.dumps(deed(3, "Stop"))])
def test_a_million_events_are_refused_in_bounded_time_and_memory(tmp_path: Path, row: str) -> None:
    folder = release(tmp_path / "log_1", annotated_log__json=None)
    with (folder / "annotated_log.json").open("w") as file:
        file.write("[" + row)
        for _ in range(1000):
            file.write(("," + row) * 1000)
        file.write("]")
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    with pytest.raises(SessionError, match=f"annotated_log.json: (holds more than {MAX_EVENTS} items|is larger than)"):
        read_sdn(folder)
    assert time.process_time() - start < 20
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1_500_000  # kB


def test_named_pipe_instead_of_a_file_does_not_block(tmp_path: Path) -> None:
    folder = release(tmp_path / "log_1", trajectory__csv=None)
    os.mkfifo(folder / "trajectory.csv")
    assert read_sdn(folder).report.missing["trajectory.csv"] == 1


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "a\0b", "T" * 5000, "Town02/../x", "\u202e"])
def test_a_town_is_a_name_and_no_path(tmp_path: Path, name: str) -> None:
    settings = config()
    settings["environment"]["map"] = name
    session = read_sdn(release(tmp_path / "maps" / "log_1", config__json=settings), maps=tmp_path)
    assert session.scene.actors.frames.size == 0 and "/" not in session.name
    assert Session.load(session.save(tmp_path / "native")).header == session.header


def test_names_of_files_in_the_log_are_never_opened(tmp_path: Path) -> None:
    def change(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            if row["type"] == "Speech":
                row["utterance_filename"] = "../../../../etc/passwd"

    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=edited(change)))
    assert session.events[session.moves()[0].index].data["audio"] == "../../../../etc/passwd"
    assert [path.name for path in session.save(tmp_path / "native").iterdir() if path.is_dir()] == []


def test_odd_texts_survive(tmp_path: Path) -> None:
    text = '"\\ud800 \\u0000 ' + "x" * 70_000 + '"'
    rows = json.dumps([move(1, "dorothy", "TEXT", "Instruct")]).replace('"TEXT"', text).replace('"text"', text)
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=rows))
    assert len(session.moves()[0].text) > 70_000
    assert Session.load(session.save(tmp_path / "native")).events == session.events


def nested(depth: int) -> Any:
    value: Any = 1
    for _ in range(depth):
        value = {"a": value}
    return value


def test_deeply_nested_extra_fields_are_cut(tmp_path: Path) -> None:
    rows = [*log(), {**deed(3, "Stop"), "note": nested(300)}]
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=rows, config__json=config(note=nested(300))))
    assert Session.load(session.save(tmp_path / "native")).events == session.events


@pytest.mark.parametrize("environment", [None, [], "x", {"landmarks": "x", "street_names": {"a": 1}, "map": 3}])
def test_a_configuration_of_wrong_types_gives_an_empty_header(tmp_path: Path, environment: Any) -> None:
    session = read_sdn(release(tmp_path / "log_1", config__json={"environment": environment, "start_frame": "x"}))
    assert (session.header.landmarks, session.header.street_names, session.header.town) == ((), (), "unknown")


def test_task_and_landmarks_of_wrong_types(tmp_path: Path) -> None:
    task = {"subgoals": [3, {"destination": 5}, {"destination": "$X"}], "hidden_from_wizard": [3], "assignments": []}
    session = read_sdn(sample(tmp_path / "one", task__json=task))
    assert session.header.subgoals == () and session.report.unknown["task: subgoal to '$X'"] == 1
    settings = config()
    settings["environment"]["landmarks"] = [3, {}, {"name": ["KFC"], "wp": 3}, {"name": "KFC", "location": ["a", None]}]
    assert len(read_sdn(sample(tmp_path / "two", config__json=settings)).header.landmarks) == 3


@pytest.mark.parametrize("value", [[], [[]], [1, 2], {"events": []}, {"events": [{"frame": 1}]}])
def test_a_hub_file_without_events(tmp_path: Path, value: Any) -> None:
    folder = hub(tmp_path / "log_1", value)
    if isinstance(value, dict) and not value["events"]:
        with pytest.raises(SessionError, match="dialog_log.json: holds no list of events"):
            read_sdn(folder)
    else:
        assert read_sdn(folder).events == ()
