"""`dorothie-gym towns`: the list with its folds, and `--check`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.maps import describe, load_town, town_names

KERB_TO_KERB = """
<OpenDRIVE><header revMajor="1" revMinor="4"/>
{roads}
</OpenDRIVE>
"""
ROAD = """
<road name="" length="100" id="{number}" junction="-1">
  <link><predecessor elementType="road" elementId="{other}" contactPoint="end"/>
    <successor elementType="road" elementId="{other}" contactPoint="start"/></link>
  <planView>{half}</planView>
  <lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center><right>
    <lane id="-1" type="driving" level="false"><link><predecessor id="-1"/><successor id="-1"/></link>
      <width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane>
  </right></laneSection></lanes>
</road>
"""
ARC = (
    '<geometry s="0" x="0" y="{y}" hdg="{heading}" length="100">'
    '<arc curvature="0.031415926535897934"/></geometry>'  # a half circle of 100 m
)
NO_NOTES: dict[str, Any] = {"dropped": {}, "repaired": {}, "assumed": {}}
RADIUS = 100.0 / 3.141592653589793


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["towns", *(str(argument) for argument in arguments)])


def ring(name: str = "ring.xodr", *, width: float = 3.5) -> Path:
    """An OpenDRIVE file with one lane around a circle, in two halves."""
    halves = (ARC.format(y=-RADIUS, heading=0.0), ARC.format(y=RADIUS, heading=3.141592653589793))
    roads = [ROAD.format(number=k, other=3 - k, half=half, width=width) for k, half in zip((1, 2), halves, strict=True)]
    path = Path(name)
    path.write_text(KERB_TO_KERB.format(roads="".join(roads)), encoding="utf-8")
    return path


def loaded(result: Result) -> Any:
    assert result.stderr == "" and result.stdout.count("\n") == 1
    return json.loads(result.stdout)


class TestList:
    def test_every_town_is_in_its_fold(self) -> None:
        result = call("--json")
        rows = {row["name"]: row for row in loaded(result)}
        assert set(rows) == set(town_names()) and rows["brookside"]["fold"] == "development"
        assert all(row["fold"] == "seen" for name, row in rows.items() if name != "brookside")
        assert describe(load_town("brookside")) == {k: v for k, v in rows["brookside"].items() if k != "fold"}

    def test_table_shows_the_folds(self) -> None:
        lines = call().stdout.splitlines()
        assert any(re.match(r"brookside +development +\d", line) for line in lines)
        assert max(map(len, lines)) <= 80


class TestCheck:
    @pytest.mark.parametrize("arguments", [("--check", "brookside"), ("brookside", "--check")])
    def test_faultless_town(self, arguments: tuple[str, ...]) -> None:
        result = call(*arguments)
        assert result.exit_code == 0 and result.stderr == ""
        facts = describe(load_town("brookside"))
        assert result.stdout.startswith(f"brookside: no faults: {facts['lanes']} lanes, {facts['links']} links, ")
        assert result.stdout.count("\n") == 1

    def test_faultless_town_as_json(self) -> None:
        result = call("--check", "brookside", "--json")
        assert result.exit_code == 0 and loaded(result) == {
            "town": "brookside",
            "traffic": "right",
            "faults": [],
            **NO_NOTES,
        }

    def test_imported_map_is_checked_like_a_shipped_one(self) -> None:
        result = call("--check", ring())
        assert result.exit_code == 0 and result.stdout.startswith("ring: no faults: 2 lanes, 2 links, 0 junctions")

    def test_one_line_for_each_fault_and_exit_code_1(self) -> None:
        result = call("--check", ring("path.xodr", width=1.5))
        assert result.exit_code == 1 and result.stderr == ""
        first, second, summary = result.stdout.splitlines()
        assert re.fullmatch(r"narrow +at \(-?\d+\.\d, -?\d+\.\d\): lane 0 is 1\.50 m wide, the car 2\.0 m", first)
        assert "lane 1 is 1.50 m wide" in second
        assert summary == "path: 2 faults (2 narrow)"

    def test_faults_as_json(self) -> None:
        result = call("--check", ring("path.xodr", width=1.5), "--json")
        assert result.exit_code == 1
        value = loaded(result)
        assert (
            value == {"town": "path", "traffic": "right", "faults": value["faults"], **NO_NOTES}
            and len(value["faults"]) == 2
        )
        fault = value["faults"][0]
        assert list(fault) == ["kind", "lanes", "position", "message"]
        assert fault["kind"] == "narrow" and fault["lanes"] == [0] and len(fault["position"]) == 2

    def test_check_can_draw_the_map(self) -> None:
        result = call("--check", ring("path.xodr", width=1.5), "--picture", "map.png")
        assert result.exit_code == 1 and result.stdout.endswith("Map: map.png\n")
        assert Path("map.png").read_bytes().startswith(b"\x89PNG")

    @pytest.mark.parametrize("more", [[], ["--json"]])
    def test_unreadable_file_is_reported(self, more: list[str]) -> None:
        Path("broken.yaml").write_text("junctions: [", encoding="utf-8")
        for path in ("missing.xodr", "broken.yaml", "nowhere"):
            result = call("--check", path, *more)
            assert result.exit_code == 2 and result.stdout == "" and path in result.stderr

    def test_check_without_a_town_is_refused(self) -> None:
        result = call("--check")
        assert result.exit_code == 2 and result.stdout == ""
        assert "name it: dorothie-gym towns --check NAME" in result.stderr


def test_picture_without_a_file_is_named_after_the_town(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for line in (["towns", "brookside", "--picture"], ["towns", "--picture", "brookside"]):
        result = CliRunner().invoke(app, line)
        assert result.exit_code == 0, result.output
        assert "Map: brookside.png" in result.output
        assert (tmp_path / "brookside.png").stat().st_size > 10_000
        (tmp_path / "brookside.png").unlink()


def noted_ring() -> Path:
    """The ring with a link to nowhere, a signal with a name, and lane sections in disorder."""
    path = ring()
    text = path.read_text(encoding="utf-8")
    text = text.replace('elementId="2" contactPoint="end"', 'elementId="99" contactPoint="end"', 1)
    sign = '<signals><signal id="S_1" s="50" t="-5" dynamic="no" type="206" orientation="+"/></signals></road>'
    path.write_text(text.replace("</road>", sign, 1), encoding="utf-8")
    return path


def test_a_check_says_what_was_dropped_and_assumed() -> None:
    result = call("--check", noted_ring())
    lines = result.stdout.splitlines()
    assert "dropped: 1 road link" in lines
    assert lines[lines.index("dropped: 1 road link") + 1].startswith("  road 1 / link / predecessor")
    assert "road 99" in lines[lines.index("dropped: 1 road link") + 1]
    assert lines[lines.index("assumed: 1 id") + 1] == "  signal S_1: is signal 0 of the town"


def test_the_json_of_a_check_holds_all_notes_by_kind() -> None:
    report = json.loads(call("--check", noted_ring(), "--json").stdout)
    assert list(report) == ["town", "traffic", "faults", "dropped", "repaired", "assumed"]
    (link,) = report["dropped"]["road link"]
    assert link["element"].startswith("road 1 / link / predecessor") and "road 99" in link["message"]
    assert report["repaired"] == {}
    assert [row["element"] for row in report["assumed"]["id"]] == ["signal S_1"]


def test_many_notes_of_a_kind_are_cut_short_but_in_json() -> None:
    path = ring()
    text = path.read_text(encoding="utf-8")
    limits = '<speed sOffset="0" max="9" unit="knots"/>' * 40
    path.write_text(text.replace("</lane>\n  </right>", f"{limits}</lane>\n  </right>", 1), encoding="utf-8")
    result = call("--check", path)
    assert result.exit_code == 0
    assert "dropped: 40 speed limits" in result.stdout and "and 30 more; --json lists all" in result.stdout
    assert len(json.loads(call("--check", path, "--json").stdout)["dropped"]["speed limit"]) == 40


def test_a_map_with_few_places_says_how_many_storyboards_need() -> None:
    straight = '<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>'
    path = Path("one_way.xodr")
    path.write_text(KERB_TO_KERB.format(roads=ROAD.format(number=1, other=9, half=straight, width=3.5)))
    words = " ".join(call(path).stdout.split())
    assert "of which cars can drive between 0; 0 of 54 storyboards fit" in words
    assert re.search(r"need 2 to \d+ places", words)
    assert "storyboards" not in call("brookside").stdout


def test_a_check_says_that_traffic_keeps_to_the_left() -> None:
    path = ring()
    text = path.read_text()
    path.write_text(text.replace("<road ", '<road rule="LHT" '))
    assert call("--check", path).stdout.splitlines()[0] == "left-hand traffic"
    assert json.loads(call("--check", path, "--json").stdout)["traffic"] == "left"
    assert json.loads(call(path, "--json").stdout)["traffic"] == "left"


class TestWriting:
    def test_town_is_written_as_opendrive(self) -> None:
        result = call("brookside", "--out", "town.xodr")
        assert result.exit_code == 0
        assert "OpenDRIVE: town.xodr" in result.stdout
        assert "no faults" in call("town.xodr", "--check").stdout

    @pytest.mark.parametrize(
        ("line", "message"),
        [
            (["brookside", "--out", "town.net"], "ends in .xodr"),
            (["brookside", "--out", "nowhere/town.xodr"], "does not exist"),
            (["--out", "town.xodr"], "name it"),
            (["ring.xodr", "--out", "ring.xodr"], "another name"),
        ],
    )
    def test_what_cannot_be_written_is_refused(self, line: list[str], message: str) -> None:
        ring()
        result = call(*line)
        assert result.exit_code == 2
        assert message in " ".join(result.stderr.split())

    def test_street_map_is_no_town(self) -> None:
        Path("district.osm").write_text("<osm/>", encoding="utf-8")
        result = call("district.osm")
        assert result.exit_code == 2
        assert "dorothie-gym towns district.osm --out district.xodr" in " ".join(result.stderr.split())
