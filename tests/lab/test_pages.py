"""Pages of the three servers: each script and style that one needs is served, and none comes from another host."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urljoin

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("httpx", reason="needs httpx, the client of starlette's tests")

from starlette.applications import Starlette
from starlette.testclient import TestClient

from dorothie_gym.archive import Corpus
from dorothie_gym.lab.annotation.server import AnnotationServer
from dorothie_gym.lab.annotation.workplace import Workplace
from dorothie_gym.lab.console.server import Console
from dorothie_gym.lab.pages import SHARED
from dorothie_gym.lab.studies.folder import running_study
from dorothie_gym.lab.studies.server import StudyServer
from tests.lab.annotation.builders import recorded
from tests.lab.studies.content import SOLO, write_study

ROOMS = SHARED.parent
ROOM_NAMES = "console", "studies", "annotation"
NEEDED = re.compile(r"""(?:src|href)="(/[^"]+)"|from '([^']+)'|addModule\('([^']+)'\)""")


def console(folder: Path) -> Starlette:
    return Console().app()


def study(folder: Path) -> Starlette:
    with running_study(write_study(folder, SOLO), folder / "data") as (found, records):
        return StudyServer(found, folder, records).app()


def annotation(folder: Path) -> Starlette:
    recorded(folder / "one")
    return AnnotationServer(Workplace(Corpus.load(folder).entries, [])).app()


def needed_by(client: TestClient, page: str) -> dict[str, str]:
    """Returns the paths of everything that a page needs with their content."""
    found, waiting = {}, [page]
    while waiting:
        path = waiting.pop()
        answer = client.get(path)
        assert answer.status_code == 200, path
        found[path] = answer.text
        names = ["".join(groups) for groups in NEEDED.findall(answer.text)]
        waiting += {urljoin(path, name) for name in names} - found.keys()
    return found


@pytest.mark.parametrize(
    ("make", "pages"),
    [(console, ["/seat"]), (study, ["/", "/experimenter"]), (annotation, ["/annotate"])],
)
def test_a_page_needs_what_its_server_has(make: Callable[[Path], Starlette], pages: list[str], tmp_path: Path) -> None:
    client = TestClient(make(tmp_path), base_url="http://127.0.0.1")
    for page in pages:
        content = needed_by(client, page)
        assert {"/static/dom.js", "/static/style.css", "/static/icon.svg"} < content.keys()
        for path, text in content.items():
            plain = text.replace("http://www.w3.org/2000/svg", "")
            assert "http://" not in plain and "https://" not in plain and "//cdn" not in plain, path


def test_every_file_is_needed_by_a_page(tmp_path: Path) -> None:
    needed: set[str] = set()
    for make, pages in ((console, ["/seat"]), (study, ["/", "/experimenter"]), (annotation, ["/annotate"])):
        folder = tmp_path / make.__name__
        folder.mkdir()
        client = TestClient(make(folder), base_url="http://127.0.0.1")
        needed |= {path for page in pages for path in needed_by(client, page)}
    served = {f"/static/{path.name}" for path in SHARED.iterdir()}
    for room in ROOM_NAMES:
        served |= {f"/{room}/{path.name}" for path in (ROOMS / room / "static").iterdir()}
    assert served == {path for path in needed if path.count("/") == 2}


def test_scripts_take_from_another_one_what_it_has() -> None:
    """A browser reports a name that is missing only when it loads the script, or even later."""
    folders = {"static": SHARED, **{room: ROOMS / room / "static" for room in ROOM_NAMES}}
    scripts = {
        f"/{name}/{path.name}": path.read_text(encoding="utf-8")
        for name, folder in folders.items()
        for path in folder.glob("*.js")
    }
    shared = re.findall(r"export (?:function|class|const) (\w+)", scripts["/static/dom.js"])
    assert len(scripts) > 30 and {"h", "notice"} < set(shared)
    for path, text in scripts.items():
        for names, source in re.findall(r"import \{ ([^}]+) \} from '([^']+)'", text):
            there = re.findall(r"export (?:async )?(?:function|class|const) (\w+)", scripts[urljoin(path, source)])
            for name in names.split(", "):
                assert name in there, (path, name)
                assert len(re.findall(rf"\b{name}\b", text)) > 1, (path, name, "is not used")
        for name in shared:
            if re.search(rf"(?<![\w.'`]){name}\((?![^()]*\) {{)", text):
                assert re.search(rf"import .*\b{name}\b.*|(?:function|const|let) {name}\b", text), (path, name)


def test_browsers_that_have_a_file_do_not_load_it_again() -> None:
    client = TestClient(Console().app(), base_url="http://127.0.0.1")
    for path in ("/seat", "/static/dom.js"):
        first = client.get(path)
        again = client.get(path, headers={"If-None-Match": first.headers["ETag"]})
        assert (
            again.status_code == 304
            and not again.content
            and "default-src 'none'" in again.headers["Content-Security-Policy"]
        )
        assert client.get(path, headers={"If-None-Match": '"other"'}).content == first.content
