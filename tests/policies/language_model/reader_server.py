"""Serves the rule programs of the three roles as a language model, over OpenAI's chat interface.

The answers come from nothing but the prompts. The server stands for a language model that makes good use of its prompt,
in rollouts and cross-play on a machine without one: `python -m tests.policies.language_model.reader_server`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer

from tests.policies.language_model.fake_server import FakeServer
from tests.policies.language_model.prompt_reader import CoWizardReader
from tests.policies.language_model.simple_readers import Interferer, guide


def answer_by_role(request: Mapping[str, Any]) -> Mapping[str, str]:
    """Returns the answer of the program of the role whose fields the request's schema has."""
    fields = request["response_format"]["json_schema"]["schema"]["properties"]
    programs: dict[str, Callable[[str], dict[str, str]]] = {
        "drive": CoWizardReader(),
        "guide": guide,
        "change": Interferer(),
    }
    program = next(program for field, program in programs.items() if field in fields)
    content = request["messages"][1]["content"]
    return program(content if isinstance(content, str) else content[0]["text"])


def main(port: Annotated[int, typer.Option(help="port on the loopback interface")] = 8011) -> None:
    """Serves until it is interrupted."""
    try:
        server = FakeServer(answer_by_role, port)
    except OSError as error:
        raise SystemExit(f"port {port}: {error.strerror}; choose another by --port") from None
    server.requests, server.headers = deque(maxlen=1), deque(maxlen=1)  # not kept
    print(f"--llm-url {server.url}", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        server.server_close()


if __name__ == "__main__":
    typer.run(main)
