"""The examples in docs/ are accepted by the package."""

import dataclasses
import importlib.util
import json
import re
import sys
import tomllib
from importlib.resources import files
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import numpy as np
import pytest
import yaml

from dorothie_gym.archive import Task
from dorothie_gym.dialogue.grammar import parse_grammar
from dorothie_gym.dialogue.phrases import Register, read_talk_files
from dorothie_gym.evaluation.closed_loop import METRICS, RecoverySeconds
from dorothie_gym.evaluation.teacher_forced import metrics_of, read_predictions
from dorothie_gym.evaluation.teacher_forced.features import Batch
from dorothie_gym.evaluation.teacher_forced.predictions import file_schema
from dorothie_gym.lab.studies.export import COLUMNS
from dorothie_gym.lab.studies.items import Item
from dorothie_gym.lab.studies.study import Study
from dorothie_gym.lab.studies.study_file import read_study
from dorothie_gym.maps import FOLD_TOWNS, SEEN_TOWNS, UNSEEN_TOWNS, VALIDATION_TOWNS, describe, load_town
from dorothie_gym.ontology import Question, WeatherParameter, paths
from dorothie_gym.policies import policy_loader
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.dialogue_channel import CabinState, signal_to_noise
from dorothie_gym.session.sensor_config import LidarConfig, LidarOutput, RadarConfig, SensorConfig, SensorMount
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.weather import Weather
from dorothie_gym.tasks import bind, load_template, template_names
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

DOCS = Path(__file__).parents[1] / "docs"


def example(page: str, language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL)
    assert found is not None
    return found.group(1)


def test_the_village_of_the_towns_page_compiles(tmp_path: Path) -> None:
    file = tmp_path / "mill_end.yaml"
    file.write_text(example("towns.md", "yaml"), encoding="utf-8")
    described = describe(load_town(file))
    assert described["junctions"] == 4
    assert len(described["components"]) == 1
    assert described["signals"] > 0
    assert described["crosswalks"] > 0


def test_the_storyboard_of_its_page_binds_to_brookside(tmp_path: Path) -> None:
    file = tmp_path / "parcel.json"
    file.write_text(example("storyboards.md", "json"), encoding="utf-8")
    storyboard = bind(load_template(file), load_town("brookside").sites, np.random.default_rng(0))
    assert [storyboard.landmarks[subgoal.landmark].hidden for subgoal in storyboard.subgoals] == [False, True]


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.glob("*.md")))
def test_pages_have_a_title_and_no_dead_links(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    assert text.startswith("# ")
    for link in re.findall(r"\]\(((?!http)[^)#]+)\)", text):
        assert (DOCS / link).exists(), f"{page} links to {link}"


def test_the_page_of_studies_has_every_field_table_and_kind_of_item(tmp_path: Path) -> None:
    page = (DOCS / "studies.md").read_text(encoding="utf-8")
    content = yaml.safe_load((files("dorothie_gym.lab.studies") / "data" / "example.yaml").read_text(encoding="utf-8"))
    content["questionnaires"]["after"] = yaml.safe_load(example("studies.md", "yaml"))
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    items = read_study(tmp_path / "study.yaml").questionnaires.after
    assert {type(item) for item in items} == set(get_args(Item))
    (spoken,) = re.findall(r"```yaml\n(session: .*?)```", page, flags=re.DOTALL)
    (tmp_path / "study.yaml").write_text(yaml.safe_dump({**content, **yaml.safe_load(spoken)}), encoding="utf-8")
    assert len(read_study(tmp_path / "study.yaml").statements) == 2, "the one of the page, and that on voices"
    rows = page.split("## Study file")[1].split("Texts are paragraphs")[0]
    assert [name for name in Study.__struct_fields__ if f"`{name}`" not in rows] == []
    assert [name for name in COLUMNS if f"| `{name}` |" not in page] == []


def test_the_storyboard_of_its_page_is_strict_json() -> None:
    assert json.loads(example("storyboards.md", "json"))


def test_the_world_page_tells_the_sight_that_the_weather_leaves() -> None:
    text = (DOCS / "world.md").read_text(encoding="utf-8")
    fog, rain, night = Weather(), Weather(), Weather()
    fog.set(WeatherParameter.FOG_DENSITY, 100.0)
    rain.set(WeatherParameter.PRECIPITATION, 100.0)
    night.set(WeatherParameter.SUN_ALTITUDE_ANGLE, -90.0)
    assert f"35 / {fog.sight(lights=False):.0f} m | the same" in text
    assert f"67 / {rain.sight(lights=False):.0f} m | the same" in text
    assert f"| night | {night.sight(lights=False):.0f} m | {night.sight(lights=True):.0f} m |" in text


def test_the_talk_of_its_page_is_worded_misheard_and_read() -> None:
    names: dict[str, object] = {}
    exec(compile(example("talk.md", "python"), "talk.md", "exec"), names)
    assert "left" in str(names["text"])
    assert names["understood"]


def test_the_policy_of_its_page_rides_in_a_rollout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    policy, rollout = re.findall(r"```python\n(.*?)```", (DOCS / "own.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    (tmp_path / "mine.py").write_text(policy, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    names: dict[str, Any] = {}
    exec(compile(rollout, "own.md", "exec"), names)
    assert not names["result"].errored
    assert names["result"].table().figures["route_completion"]["mean"] > 0.0


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of the libraries
@pytest.mark.parametrize("number", range(2))
def test_learning_of_its_page_runs_as_written(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sb3_contrib")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(
        r"```python\n(.*?)```", (DOCS / "learning-roles.md").read_text(encoding="utf-8"), flags=re.DOTALL
    )
    exec(compile(blocks[number], "learning-roles.md", "exec"), {})
    assert number == 1 or (tmp_path / "co_wizard.png").stat().st_size > 10_000


def test_speech_of_its_page_is_recognised() -> None:
    text = example("speech.md", "python")
    names: dict[str, Any] = {}
    exec(compile(text, "speech.md", "exec"), names)
    assert f"# {names['heard'].text}\n" in text
    assert text.endswith(f"# {names['understand_speech'](names['heard']).text}\n")


def test_speech_page_states_the_noise_of_the_car() -> None:
    text = (DOCS / "speech.md").read_text(encoding="utf-8")
    states = CabinState(), CabinState(speed=50 / 3.6), CabinState(speed=50 / 3.6, rain=100.0)
    parked, driving, raining = (round(signal_to_noise(state)) for state in states)
    assert f"is {parked} dB in a parked car, {driving} dB at 50 km/h, and {raining} dB at 50 km/h" in text


def test_the_phrases_of_the_talk_page_are_grammar() -> None:
    text = example("talk.md", "text").replace("<soon>", "<soon_enough>")
    assert parse_grammar({**read_talk_files(), "page.talk": text})


def test_the_annotation_page_shows_the_decision_tree() -> None:
    page = (DOCS / "annotation.md").read_text().split("## Rules")[0]
    rows = re.findall(r"^(?:(\d+)\. (.+\?)|    - (.+?)(?:: \*\*(\w+)\*\*| \((\d+)\)))$", page, re.MULTILINE)
    shown: dict[str, list[tuple[str, str]]] = {}
    number = ""
    for question, text, label, move, following in rows:
        number = question or number
        shown.setdefault(number, []).append((text, "") if question else (label, move or following))
    numbers = {entries[0][0]: number for number, entries in shown.items()}
    found: dict[str, dict[str, str]] = {}
    for path, _ in paths():
        for question, answer in path:
            after = answer.next
            goes = numbers[after.text] if isinstance(after, Question) else after.label
            found.setdefault(numbers[question.text], {})[answer.label] = goes
    assert found == {number: dict(entries[1:]) for number, entries in shown.items()}


def test_the_example_of_the_camera_page_takes_a_picture() -> None:
    names: dict[str, Any] = {}
    exec(compile(example("camera.md", "python"), "camera.md", "exec"), names)
    assert names["picture"].shape == (160, 240, 3)


def test_the_camera_page_has_the_defaults_of_all_settings() -> None:
    text = (DOCS / "camera.md").read_text(encoding="utf-8")
    config = CameraConfig()
    assert f"| {config.width}, {config.height} | pixels |" in text
    assert f"| {config.field_of_view:g} | horizontal, degrees |" in text
    assert f"`{config.mount}`" in text
    missing = [field.name for field in dataclasses.fields(CameraConfig) if f"`{field.name}`" not in text]
    missing += [output.name for output in CameraOutput if f"`{output.name}`" not in text]
    assert missing == []


def test_the_example_of_the_sensors_page_reads_them() -> None:
    names: dict[str, Any] = {}
    exec(compile(example("sensors.md", "python"), "sensors.md", "exec"), names)
    seen, points = names["seen"], names["points"]
    assert seen["left_camera"].shape == seen["rear_camera"].shape == (80, 120, 3)
    assert points.ndim == 2 and points.shape[1] == 4 and len(points) > 1000
    assert {"optical_flow", "radar", "accelerometer", "collision"} <= set(seen)


def test_the_sensors_page_has_the_defaults_of_all_settings() -> None:
    text = (DOCS / "sensors.md").read_text(encoding="utf-8")
    lidar, radar = LidarConfig(), RadarConfig()
    for values in (
        (lidar.channels,), (lidar.columns,), (lidar.range,), (lidar.upper_fov, lidar.lower_fov), (lidar.rate,),
        (radar.rows, radar.columns), (radar.horizontal_fov, radar.vertical_fov), (radar.range,),
    ):  # fmt: skip
        assert f"| {', '.join(f'{value:g}' for value in values)} |" in text
    kinds = (LidarConfig, RadarConfig, SensorMount, SensorConfig)
    missing = [field.name for kind in kinds for field in dataclasses.fields(kind) if f"`{field.name}`" not in text]
    missing += [output.name for output in LidarOutput if f"`{output.name}`" not in text]
    assert [name for name in missing if name not in ("lidar", "radar")] == []
    assert f"SensorMount(up={lidar.mount.up:g})" in text
    assert f"SensorMount(forward={radar.mount.forward:g}, up={radar.mount.up:g})" in text


def test_the_predictions_of_their_page_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(example("predictions.md", "python"), "predictions.md", "exec"), {})
    read = read_predictions("predictions.parquet")
    assert [(given.model, given.task.value, len(given.events)) for given in read] == [
        ("mine", "ufn", 1),
        ("mine", "nfd", 1),
    ]


def test_the_predictions_page_has_every_column_and_metric() -> None:
    text = (DOCS / "predictions.md").read_text(encoding="utf-8")
    for name in (*file_schema().names, *metrics_of(Task.UFN), *metrics_of(Task.NFD)):
        assert f"`{name}`" in text, name


def test_the_examples_of_the_tasks_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "corpus" / "train" / "one", talk())
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "tasks.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    examples = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    for number, code in enumerate(examples):
        exec(compile(code, f"tasks.md, example {number}", "exec"), names)
    assert len(examples) == 3
    assert names["batch"].move.shape == (4, 8)
    assert set(names["info"]["reward_terms"]) <= {"action", "joint"}


def test_the_example_of_the_statistics_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "CORPUS" / "train" / "one", talk())
    monkeypatch.chdir(tmp_path)
    exec(compile(example("statistics.md", "python"), "statistics.md", "exec"), {})


def test_the_tasks_page_names_every_field_of_a_batch() -> None:
    text = (DOCS / "tasks.md").read_text(encoding="utf-8")
    missing = [field.name for field in dataclasses.fields(Batch) if f"`{field.name}`" not in text]
    assert missing == []


def pages(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Returns the script that writes pages, which is in no package."""
    monkeypatch.syspath_prepend(str(DOCS))  # it imports a module beside it
    spec = importlib.util.spec_from_file_location("pages", DOCS / "pages.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["pages"] = module  # where its dataclasses look for their types
    spec.loader.exec_module(module)
    return module


def test_the_figures_of_the_data_sheet_are_those_of_a_corpus(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for fold in ("train", "test/unseen"):
        write(tmp_path / "corpus" / fold / "one", talk())
    made = {"sessions": 2, "seed": 41, "package_version": "9.9"}
    (tmp_path / "corpus" / "generation.json").write_text(json.dumps(made), encoding="utf-8")
    sheet = tmp_path / "data-sheet.md"
    sheet.write_text((DOCS / "data-sheet.md").read_text(encoding="utf-8"), encoding="utf-8")
    script = pages(monkeypatch)
    monkeypatch.setattr(script, "DATA_SHEET", sheet)
    for _ in range(2):  # written anew, the old figures are gone
        script.main(["figures", str(tmp_path / "corpus")])
    page = sheet.read_text(encoding="utf-8")
    assert page.count("dorothie-gym generate --sessions 2 --seed 41 --out CORPUS") == 1
    assert "| utterances | 10 | 8,415 |" in page and "| 24 | speech trouble repaired | 0 | - |" in page
    assert page.startswith("# Data sheet") and page.count(script.BEGIN) == page.count(script.END) == 1


_WORDS = {"two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7}


def test_the_counts_of_the_data_sheet_are_those_of_the_shipped_storyboards_and_towns() -> None:
    text = " ".join((DOCS / "data-sheet.md").read_text(encoding="utf-8").split())

    def stated(pattern: str) -> tuple[int, ...]:
        found = re.search(pattern, text)
        assert found is not None, pattern
        return tuple(_WORDS.get(each.lower(), 0) or int(each) for each in found.groups())

    boards = [load_template(name) for name in template_names()]
    errands = [len(board.subgoals) for board in boards]
    at_first = [sum(not subgoal.trigger for subgoal in board.subgoals) for board in boards]
    assert stated(r"with (\w+) to (\w+) errands, of one of (\d+) storyboards") == (
        min(errands),
        max(errands),
        len(boards),
    )
    assert (min(at_first), max(at_first)) == (min(errands), max(errands)), "the list begins with as many"
    assert stated(
        r"In (\d+) of these an errand can be added, in (\d+) deleted, in (\d+) changed; in (\d+) a place is hidden"
    ) == (
        sum(any(subgoal.trigger for subgoal in board.subgoals) for board in boards),
        sum(
            any(subgoal.delete or subgoal.delete_after_subgoal is not None for subgoal in board.subgoals)
            for board in boards
        ),
        sum(any(subgoal.change for subgoal in board.subgoals) for board in boards),
        sum(bool(board.hidden) for board in boards),
    )
    assert stated(r"at (\d+) Hz; the surrounding .* at each decision, (\d+) per second") == (
        FRAME_RATE,
        EnvConfig().decision_frequency,
    )
    assert f"by default in {100 * EnvConfig().word_error_rate:.1f} % of the words" in text
    assert stated(r"(\w+) towns are in `train` and in the seen folds") == (len(SEEN_TOWNS),)
    assert stated(r"`val/unseen` in (\d+), `test/unseen` in (\d+)") == (len(VALIDATION_TOWNS), len(UNSEEN_TOWNS))
    assert f"Styles vary ({', '.join(register.name.lower() for register in Register)};" in text


def test_the_page_of_towns_lists_each_fold() -> None:
    page = (DOCS / "towns.md").read_text(encoding="utf-8")
    for fold, towns in FOLD_TOWNS.items():
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{fold}` |")]
        ends = towns if len(towns) < 5 else (f"`{towns[0]}` to `{towns[-1]}`",)
        assert all(name in row for name in ends)


def test_the_page_of_storyboards_counts_the_templates() -> None:
    text = " ".join((DOCS / "storyboards.md").read_text(encoding="utf-8").split())
    assert f"The package ships {len(template_names())} templates" in text


def test_the_page_of_transcripts_shows_three_sessions_of_different_kinds() -> None:
    page = (DOCS / "transcripts.md").read_text(encoding="utf-8")
    easy, environmental, task = page.split("\n## ")[1:]
    assert "(env)" not in easy and "(task)" not in easy
    assert environmental.count("(env)") >= 3 and task.count("(task)") >= 2
    for section in (easy, environmental, task):
        assert "dorothie-gym show S" in section and "Ended with success" in section


def test_the_diagram_of_the_architecture_has_the_order_of_the_import_contract() -> None:
    contract = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(each["layers"] for each in contract["contracts"] if each["type"] == "layers")
    diagram = (DOCS / "architecture.md").read_text(encoding="utf-8").split("```")[1].splitlines()
    lines = []
    packages = layers[:-1]  # those below serve every package: see the text
    for layer in packages:
        names = [name.strip().removeprefix("dorothie_gym.") for name in layer.split("|")]
        found = {
            next((k for k, line in enumerate(diagram) if re.search(rf"(^|\s){name}\s\s", line)), None) for name in names
        }
        assert len(found) == 1, f"{layer} is not one line of the diagram"
        lines += found
    assert None not in lines and lines == sorted(lines)


def test_the_models_page_has_the_cards_of_the_shipped_models(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (DOCS / "models.md").read_text(encoding="utf-8")
    assert pages(monkeypatch).models() in text, "it is out of date: run python docs/pages.py models"
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    section = text.split("## Shipped models")[1].split("\n## ")[0]
    for code in re.findall(r"```python\n(.*?)```", section, flags=re.DOTALL):
        exec(compile(code, "models.md", "exec"), {})
    assert "CardFigure(mean=0." in capsys.readouterr().out


def test_every_page_is_in_the_navigation() -> None:
    navigation = (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8")
    assert [path.name for path in DOCS.glob("*.md") if f": {path.name}" not in navigation] == []


def test_the_examples_of_the_closed_loop_page_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(policy_loader, "_LOADERS", {})
    text = (DOCS / "closed-loop.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL):
        exec(compile(block, "closed-loop.md", "exec"), names)
    printed = capsys.readouterr().out
    assert re.match(r"0\.0 0\.0 0\.65\d+ 0\n\[0\.", printed)  # none of two succeeded
    for metric in (*METRICS, RecoverySeconds()):
        assert f"| {metric.title} | `{metric.key}` |" in text
