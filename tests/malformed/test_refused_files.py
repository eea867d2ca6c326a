"""Files that no user means to give are refused at once, in one line, by every command that reads files."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.ontology import Role
from tests.evaluation.teacher_forced.corpora import corpus
from tests.malformed.memory import peak_memory
from tests.malformed.mutation import mutate_folder
from tests.malformed.subjects import SUBJECTS
from tests.session.recording.builders import utterance, write
from tests.session.recording.dialogues import TO_KFC, talk

DEPTH = "[" * 100_000
LONG = "9" * 5000


def refusal(*arguments: object) -> str:
    """Runs a command, which must refuse its input; returns the message."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    assert result.exit_code == 2, result.output
    message = result.output.strip()
    assert len(message.splitlines()) == 1 and len(message) < 1500, message
    return message


@pytest.fixture(params=["pipe", "device", "folder"])
def no_file(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Path]:
    """Puts a pipe without a writer, an endless device or a folder in the place of a file."""

    def make(name: str) -> Path:
        path = tmp_path / name
        if path.exists():
            path.unlink()
        path.parent.mkdir(parents=True, exist_ok=True)
        if request.param == "folder":
            path.mkdir()
        elif request.param == "device":
            path.symlink_to("/dev/zero")
        else:
            os.mkfifo(path)
        return path

    return make


@pytest.mark.timeout(60)
@pytest.mark.skipif(sys.platform == "win32", reason="has no pipes in folders")
def test_pipes_and_devices_are_refused_in_place_of_every_file(no_file: Callable[[str], Path], tmp_path: Path) -> None:
    write(tmp_path / "corpus/one", talk())
    write(tmp_path / "corpus/two", talk())
    sessions = ("--corpus", tmp_path / "corpus", "--split", "all")
    assert "p.parquet" in refusal("evaluate", no_file("p.parquet"), *sessions)
    for name in ("town.yaml", "town.xodr"):
        assert name in refusal("towns", no_file(name))
    assert "story.json" in refusal("run", "--storyboard", no_file("story.json"))
    no_file("rollout/rollout.json")
    assert "rollout" in refusal("leaderboard", tmp_path / "rollout", "--out", tmp_path / "board.md")
    no_file("model/model.json")
    assert "model.json" in refusal("rollout", "--co-wizard", tmp_path / "model", "--sessions", 1)
    no_file("corpus/one/events.jsonl")
    assert "events.jsonl" in refusal("show", tmp_path / "corpus/one")


@pytest.mark.parametrize(
    ("command", "name", "content"),
    [
        (("towns",), "deep.yaml", "a: " + DEPTH),
        (("towns",), "alias.yaml", "a: &a [x]\n" + "".join(f"b{k}: &b{k} [*a, *a]\n" for k in range(40))),
        (("towns",), "large.yaml", "#" * 2_000_000),
        (("towns",), "entities.xodr", '<!DOCTYPE x [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><OpenDRIVE>&b;</OpenDRIVE>'),
        (("towns",), "large.xodr", "<OpenDRIVE>" + "<road/>" * 2_100_000 + "</OpenDRIVE>"),
        (("run", "--storyboard"), "deep.json", DEPTH),
        (("run", "--storyboard"), "long.json", f'{{"story": "a", "subgoals": [{{"after": [{LONG}]}}]}}'),
        (("run", "--storyboard"), "large.json", json.dumps({"story": "a" * 100_000_000})),
        (("evaluate",), "text.parquet", "row"),
        (("evaluate",), "empty.parquet", ""),
    ],
)
def test_large_deep_and_recursive_files_are_refused(
    command: tuple[str, ...], name: str, content: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(content)
    sessions = ("--corpus", corpus(tmp_path / "corpus", ("test/seen",))) if command == ("evaluate",) else ()
    assert name in refusal(*command, tmp_path / name, *sessions)


@pytest.mark.long
@pytest.mark.parametrize("column", ["session", "slots"])
def test_small_file_of_predictions_cannot_stand_for_gigabytes(column: str, tmp_path: Path) -> None:
    rows, long = 600, pa.array(["x" * 30_000_000])
    row = {"version": 1, "model": "m", "seed": 0, "task": "ufn", "session": "a", "event": 1, "move": "Instruct"}
    table = pa.table({name: [value] * rows for name, value in row.items() if name != column})
    bomb = pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, np.int32)), long)
    if column == "slots":
        bomb = pa.ListArray.from_arrays(pa.array(np.arange(rows + 1, dtype=np.int32)), bomb)
    table = table.append_column(column, bomb)
    pq.write_table(table, tmp_path / "p.parquet", compression="zstd", dictionary_pagesize_limit=2**30)
    assert (tmp_path / "p.parquet").stat().st_size < 1_000_000
    script = (
        "import sys; from pathlib import Path; from dorothie_gym.evaluation.teacher_forced import read_predictions\n"
        "from tests.malformed.memory import peak_memory\n"
        "try:\n    read_predictions(Path(sys.argv[1]))\nexcept ValueError as error:\n    print(error)\n"
        "print(peak_memory())"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "p.parquet"], capture_output=True, text=True, check=True
    )
    message, used = done.stdout.strip().splitlines()
    assert "MiB of text" in message and int(used) < 1_000_000_000


@pytest.mark.timeout(60)
def test_twenty_thousand_moves_in_one_exchange_are_refused_at_once(tmp_path: Path) -> None:
    moves = [event for k in range(20_000) for event in utterance(60, Role.PARTICIPANT, k, ("To the KFC.", TO_KFC))]
    folder, before = write(tmp_path / "corpus/one", moves, source="sdn-release"), peak_memory()
    assert "at most 10000" in refusal("evaluate", "--corpus", folder.parent, "--split", "all")
    assert peak_memory() - before < 1_000_000_000


@pytest.mark.parametrize(
    "config",
    [
        {"world": {"vehicles": 2.5}}, {"world": {"vehicles": "8"}}, {"world": [1]}, {"rewards": {"time": None}},
        {"max_seconds": True}, {"unknown": 1}, {"world": {"planes": 1}}, {"decision_frequency": []},
        {"world": {"vehicles": -1}},
    ],
)  # fmt: skip
def test_replay_refuses_a_config_of_wrong_types(config: dict[str, Any], tmp_path: Path) -> None:
    from dorothie_gym.session.recording import Decision, Session
    from tests.session.recording.builders import session

    made = session(talk(), town="brookside", config=config)
    with_decisions = Session(**{**vars(made), "decisions": (Decision(frame=15, actions={}),)})
    with_decisions.save(tmp_path / "one")
    assert "config" in refusal("replay", tmp_path / "one", "--check")


@pytest.mark.parametrize(("field", "value"), [("seed", -1), ("seed", 1.5), ("seed", int(LONG[:60])), ("config", [])])
def test_session_with_a_header_of_wrong_types_is_refused(field: str, value: object, tmp_path: Path) -> None:
    header = write(tmp_path / "one", talk()) / "session.json"
    header.write_text(json.dumps({**json.loads(header.read_text()), field: value}))
    for command in ("show", "replay", "stats"):
        assert "session.json" in refusal(command, tmp_path / "one")


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("settings", "sessions_planned"), "4"), (("settings", "towns"), 3), (("settings", "config"), []),
        (("settings", "seed"), -1), (("rows",), {}), (("rows", 0, "seed"), None), (("rows", 0, "record", "live"), 2.5),
        (("rows", 0, "record", "completion"), 7), (("rows", 0, "record", "talk"), [1]),
        (("rows", 0, "record", "infractions"), {"vehicle": "many"}),
        (("rows", 0, "record", "exceptions"), [{"kind": "x"}]),
        (("settings", "training"), {"co_wizard": {"steps": "many"}}),
    ],
)  # fmt: skip
def test_leaderboard_names_the_wrong_field_of_a_rollout(place: tuple[Any, ...], value: object, tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    SUBJECTS["rollout"].make(tmp_path / "one")
    path = tmp_path / "one/rollout.json"
    page = json.loads(path.read_text())
    node = page
    for step in place[:-1]:
        node = node[step]
    node[place[-1]] = value
    path.write_text(json.dumps(page))
    message = refusal("leaderboard", tmp_path / "one", "--out", tmp_path / "board.md")
    assert "rollout.json" in message and str(place[-1]) in message


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"network": [300_000_000, 300_000_000]}, "network"),
        ({"network": [8192, 8192]}, "network"),
        ({"parameters": {"buffer_size": 10**15, "n_steps": 10**12}}, "parameters"),
        ({"steps": "many"}, "steps"),
        ({"unknown": 1}, "unknown"),
        ({"environments": 10**9}, "environments"),
    ],
)
def test_model_folder_cannot_ask_for_absurd_networks(fields: dict[str, Any], named: str, tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    SUBJECTS["rl"].make(tmp_path)
    path = tmp_path / "rl/model.json"
    page = json.loads(path.read_text())
    page["settings"] |= fields
    path.write_text(json.dumps(page))
    message = refusal("rollout", "--co-wizard", tmp_path / "rl", "--sessions", 1)
    assert "model.json" in message and named in message


def test_repeated_column_of_an_sdn_trajectory_is_refused(tmp_path: Path) -> None:
    from tests.archive.sdn.builders import release

    path = release(tmp_path / "corpus/one") / "trajectory.csv"
    header, *rows = path.read_text().splitlines()
    path.write_text("\n".join([f"{header},x", *(f"{row}," for row in rows)]))
    message = refusal("show", tmp_path / "corpus/one")
    assert "trajectory.csv" in message and "'x'" in message and "twice" in message
    message = refusal("evaluate", "--corpus", tmp_path / "corpus", "--split", "all")
    assert "trajectory.csv" in message and "choose from all" not in message


@pytest.mark.long
@pytest.mark.parametrize("command", ["show", "stats", "replay", "transcript", "compare", "convert", "evaluate"])
def test_commands_never_end_in_a_traceback_over_damaged_sessions(command: str, tmp_path: Path) -> None:
    for number in range(6):
        folder = tmp_path / f"{number}"
        write(folder / "one", talk(), town="brookside")
        write(folder / "two", talk(), town="brookside")
        shutil.copytree(folder, tmp_path / f"{number}-sound")
        mutate_folder(folder, Random(number))
        arguments = {
            "compare": (folder, tmp_path / f"{number}-sound"),
            "convert": (folder, tmp_path / f"{number}-converted", "--to", "sdn"),
            "evaluate": ("--corpus", folder, "--split", "all"),
            "transcript": (folder / "one",),
            "show": (folder / "one",),
        }.get(command, (folder,))
        result = CliRunner().invoke(app, [command, *map(str, arguments)])
        assert result.exception is None or isinstance(result.exception, SystemExit), (number, result.exception)
