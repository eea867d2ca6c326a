"""Kills the server of a study again and again while people take part and withdraw, and looks at what it leaves.

On the way, the disk is full for a while at random moments. `python -m tests.lab.studies.killing --times 50 --seed 7`
prints what was promised and kept, as JSON; fails where something that was acknowledged is lost, or something that was
erased is left.
"""

from __future__ import annotations

import argparse
import http.client
import json
import random
import signal
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from websockets.exceptions import ConnectionClosed, InvalidMessage

from dorothie_gym.lab.studies.export import export_study
from dorothie_gym.lab.studies.stages import Stage
from tests.cli.test_study import running
from tests.full_disk import full_disk, wait_for
from tests.lab.studies.content import SOLO, write_study
from tests.lab.studies.serving import Client
from tests.lab.studies.test_server import remains

CONTENT = {
    **SOLO,
    "tutorial": None,
    "session": {"max_seconds": 300.0, "pictures": False},
    "absence": {"seconds": 600.0, "then": "wait"},
    "questionnaires": {"before": [{"id": "word", "kind": "text", "text": "A word?"}]},
}

LOST = OSError, http.client.HTTPException, EOFError, ConnectionClosed, InvalidMessage, AssertionError
"""Errors of people whose server has died; a refusal is an `AssertionError`, and is looked at by `check`."""

STEPS = (
    Stage.CONSENT, Stage.BEFORE, Stage.INSTRUCTIONS, Stage.LOBBY, Stage.SESSION, Stage.AFTER, Stage.DEBRIEFING,
    Stage.DONE,
)  # fmt: skip

FULL = 0, 2, 3, 4, 6
"""Possible numbers of times that the disk is full during the life of a server."""

AT_WORK = 0.7
"""Share of the servers at which somebody is at work before anything happens; the others are struck while they start."""

LEAVING = Stage.INSTRUCTIONS, Stage.LOBBY, Stage.SESSION, None
"""Stages at which people withdraw, all of whom have answered."""


@dataclass
class Person:
    """Person and what the server has acknowledged.

    Attributes:
        client: the browser.
        word: what the person answers and says, which nobody else does.
        withdraws: stage at which the person withdraws; None for one who stays.
        stage: stage that was shown last.
        answered: whether the answer was acknowledged.
        said: whether what the person said was heard.
        gone: whether the withdrawal was.
        asked: whether it was asked for.
    """

    client: Client
    word: str
    withdraws: Stage | None
    stage: Stage | None = None
    answered: bool = False
    said: bool = False
    gone: bool = False
    asked: bool = False

    def go(self) -> None:
        """Goes as far as the server lives."""
        try:
            if self.stage is None:
                self._do("join", {"parameters": {"PROLIFIC_PID": f"platform-{self.word}"}, "visit": self.word * 3})
            while self.stage is not Stage.DONE:
                if self.stage is self.withdraws:
                    return self._withdraw()
                if self.stage is Stage.SESSION and not self.client.view.get("over"):
                    return self._play()
                self._step()
            assert self.client.view["code"] == "FINISHED"
        except LOST:
            return

    def _play(self) -> None:
        self.client.follow(lambda: self.client.view.get("token") or self.client.view.get("over"))
        if self.client.view.get("over"):
            return  # its record could not be written
        with self.client.sit() as seat:
            self.client.say(seat, f"{self.word}, please.")
            self.said = True
            if self.withdraws is not None:
                self._withdraw()

    def _withdraw(self) -> None:
        self.asked = True
        if self._post("withdraw", {"sure": True}) == 200:
            self.gone = True

    def _step(self) -> None:
        if self.stage is Stage.CONSENT:
            self._do("consent", {"agreed": [True, True]})
        elif self.stage is Stage.BEFORE:
            self._do("answers", {"stage": "before", "answers": {"word": self.word}})
            self.answered = True
        elif self.stage is Stage.INSTRUCTIONS:
            self._do("proceed", {"stage": "instructions"})
        elif self.stage is Stage.AFTER:
            self._do("answers", {"stage": "after", "answers": {"trust": 5}})
        elif self.stage in (Stage.SESSION, Stage.DEBRIEFING):
            self._do("proceed", {"stage": self.stage.value})
        else:
            self._do("news", {"have": self.client.tag})

    def _do(self, name: str, body: object) -> None:
        status = self._post(name, body)
        assert status == 200, (status, self.client.answer)
        self.stage = Stage(self.client.stage)

    def _post(self, name: str, body: object) -> int:
        """Sends a request, again for as long as it cannot be stored, as the page does."""
        while (status := self.client.post(name, body)) == 503:
            time.sleep(0.2)
        return status

    def check(self, port: int) -> None:
        """Looks at the next server whether it has kept what was acknowledged."""
        self.client.port, self.client.tag = port, ""
        if self.stage is None:
            return
        status = self.client.post("news")
        if self.gone or (self.asked and status == 401):  # done, though its answer was lost
            assert status == 401, (self.word, status)
            self.gone = True
            return
        assert status == 200, (self.word, self.stage, status, self.client.answer)
        shown = Stage(self.client.stage)
        assert STEPS.index(shown) >= STEPS.index(self.stage), (self.word, self.stage, shown)
        self.stage = shown

    def check_record(self, sessions: Path) -> None:
        """Looks at the records of the sessions whether they have what was heard."""
        if self.said and not self.gone:
            assert remains(sessions, self.word), self.word


def kill_again_and_again(folder: Path, *, times: int, seed: int, longest: float = 8.0) -> dict[str, int]:
    """Lets people take part in a study whose server is killed at random moments.

    Args:
        folder: folder of the study.
        times: number of kills.
        seed: seed of the moments and people.
        longest: longest life of a server after its start [s].

    Returns:
        Numbers of kills, full disks, people, withdrawals, answers and sayings that were acknowledged.
    """
    drawn, people, full = random.Random(seed), list[Person](), 0
    file, data = write_study(folder, CONTENT), folder / "data"
    for round_ in range(times + 1):
        with running(file, data) as (server, port):
            for person in people:
                person.check(port)
                person.check_record(data / "sessions")
            _check_files(data, people)
            if round_ == times:
                break
            people += [Person(Client(port), f"Word{seed}x{len(people) + k}x", drawn.choice(LEAVING)) for k in range(3)]
            here = [person for person in people if not person.gone][-6:]
            threads = [threading.Thread(target=person.go) for person in here]
            for thread in threads:
                thread.start()
            if drawn.random() < AT_WORK:
                new = people[-3:]
                wait_for(lambda new=new: any(person.said and not person.gone for person in new))  # type: ignore[misc]
            for _ in range(drawn.choice(FULL)):
                full += 1
                time.sleep(drawn.uniform(0.0, longest / 4))
                with full_disk(drawn.choice([0, 1000, 30_000, 200_000]), server.pid):
                    time.sleep(drawn.uniform(0.1, longest / 8))
            time.sleep(drawn.uniform(0.1, longest))
            server.send_signal(signal.SIGKILL)
            server.wait(10)
            for thread in threads:
                thread.join(60.0)
    export_study(data, folder / "tables")
    answers = (folder / "tables" / "answers.csv").read_text(encoding="utf-8")
    for person in people:
        if person.gone:
            assert remains(folder / "tables", person.word) == [], person.word
        elif person.answered:
            assert person.word in answers, person.word
    return {
        "kills": times,
        "full_disks": full,
        "people": len(people),
        "withdrawn": sum(person.gone for person in people),
        "answers": sum(person.answered for person in people),
        "said": sum(person.said for person in people),
    }


def _check_files(data: Path, people: list[Person]) -> None:
    for person in people:
        if person.gone:
            left = remains(data, person.word)
            assert left == [], (person.word, left)


def main() -> None:
    """Kills as often as the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(kill_again_and_again(Path(folder), times=asked.times, seed=asked.seed)))


if __name__ == "__main__":
    main()
