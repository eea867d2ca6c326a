"""`dorothie-gym show`: transcripts of sessions, and the sound of their utterances."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from dorothie_gym import archive
from dorothie_gym.cli.options import Maps
from dorothie_gym.cli.output import FAILED, check_file, fail, reporting_errors, stdout
from dorothie_gym.evaluation import analysis

if TYPE_CHECKING:
    from dorothie_gym.support.audio import Samples


PLAYERS: Final[Sequence[Sequence[str]]] = (
    ("pw-play",),
    ("paplay",),
    ("aplay", "-q"),
    ("afplay",),
    ("play", "-q"),
    ("ffplay", "-nodisp", "-autoexit", "-loglevel", "error"),
)
"""Programs that play a WAV file, with their options: of PipeWire, PulseAudio, ALSA, macOS, SoX and FFmpeg."""

_SPAN: Final = re.compile(r"(\d{1,9})(?:\.(\d{1,9}))?")


def show(
    session: Annotated[list[Path], typer.Argument(metavar="SESSION...", help="Sessions of any layout.")],
    play: Annotated[
        str | None,
        typer.Option(metavar="N[.SPAN]", help="Play utterance N of a spoken session, or one of its spans, from 0."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File to write (.md; with --play .wav); default standard output or a player."
        ),
    ] = None,
    maps: Maps = None,
) -> None:
    """Write annotated transcripts as Markdown: utterances, dialogue acts, exchanges, transactions and other events.

    Transcripts of spoken sessions give the numbers of the utterances, of which --play plays one.
    """
    if play is not None:
        _play(session, play, out, maps)
        return
    with reporting_errors():
        page = "\n".join(analysis.markdown(archive.read_session(path, maps=maps)) for path in session)
        if out is not None:
            out.write_text(page, encoding="utf-8", newline="\n")
        else:
            typer.echo(page, nl=False)


def _play(sessions: Sequence[Path], wanted: str, out: Path | None, maps: Path | None) -> None:
    found = _SPAN.fullmatch(wanted)
    if found is None:
        fail(f"--play {wanted}: give the number of an utterance (12), or also that of a span of it (12.0)")
    if len(sessions) > 1:
        fail(f"--play takes one session, not {len(sessions)}")
    if out is not None:
        if out.suffix.lower() != ".wav":
            fail(f"{out}: sound is written as WAV; give a name that ends in .wav")
        check_file(out)
    with reporting_errors():
        from dorothie_gym.support.audio import encode_wav

        number, span = int(found[1]), None if found[2] is None else int(found[2])
        samples = archive.utterance_audio(archive.read_session(sessions[0], maps=maps), number, span)
        if out is not None:
            out.write_bytes(encode_wav(samples))
            return
        _play_aloud(samples)


def _play_aloud(samples: Samples) -> None:
    """Plays audio with the first player of `PLAYERS` on the search path that can; fails if there is none."""
    from dorothie_gym.support.audio import SAMPLE_RATE, encode_wav

    commands = [(path, *options) for name, *options in PLAYERS if (path := shutil.which(name)) is not None]
    if not commands:
        names = ", ".join(name for name, *_ in PLAYERS)
        fail(f"no program that plays sound is installed ({names}); write it to a file: --out FILE.wav", FAILED)
    faults = []
    with tempfile.TemporaryDirectory(prefix="dorothie_gym.") as folder:
        file = Path(folder) / "speech.wav"
        file.write_bytes(encode_wav(samples))
        for command in commands:
            done = subprocess.run([*command, str(file)], stdin=subprocess.DEVNULL, capture_output=True, check=False)
            if done.returncode == 0:
                stdout().print(f"{len(samples) / SAMPLE_RATE:.1f} s played by {Path(command[0]).name}")
                return
            said = done.stderr.decode(errors="replace").strip().splitlines()
            faults.append(f"{Path(command[0]).name}: {said[-1] if said else f'exit code {done.returncode}'}")
    fail(f"the sound cannot be played ({'; '.join(faults)}); write it to a file: --out FILE.wav", FAILED)
