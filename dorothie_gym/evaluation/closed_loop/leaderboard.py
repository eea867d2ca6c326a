"""Leaderboard of policies from the results of rollouts, as a Markdown page and a picture."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Final

from dorothie_gym.errors import RolloutError, printable
from dorothie_gym.evaluation.closed_loop.claims import Claim, claims_of
from dorothie_gym.evaluation.closed_loop.protocol import LeaderboardProtocol, part_of, sealed_part
from dorothie_gym.evaluation.closed_loop.results import (
    ALL_METRICS,
    NO_EXCEPTION,
    RESULT_FILE,
    RolloutResult,
    RolloutTable,
    figure_text,
    is_undefined,
    read_result,
)
from dorothie_gym.evaluation.closed_loop.running import command_of, fold_of_towns, is_given, towns_text, usual_settings
from dorothie_gym.evaluation.closed_loop.session_record import Amount
from dorothie_gym.evaluation.closed_loop.submission import SubmissionCheck, check_submission
from dorothie_gym.evaluation.closed_loop.usage import tokens_text
from dorothie_gym.evaluation.rollout.runner import COST_FILE
from dorothie_gym.evaluation.tiers import TIERS
from dorothie_gym.maps.default_lights import split_lights
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.policies.language_model.usage import SILENT_SHARE
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, raising, read_json

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.metrics import ShownMetric

IMPORTED: Final = "imported"
"""Part of the leaderboard for rollouts in towns from OpenDRIVE files."""

OTHER: Final = "other"
"""Part of the leaderboard for rollouts in towns of several parts, or of none."""

PART_TITLES: Final[Mapping[str, str]] = {
    "seen": "Seen towns",
    "development": "Development town",
    "validation": "Validation towns",
    "unseen": "Unseen towns",
    IMPORTED: "Imported towns",
    OTHER: "Other towns",
    **{name: f"Tier {name}" for name in TIERS},
    **{sealed_part(name): f"Tier {name}, sealed before the test" for name in TIERS},
}
"""Parts of the page and their titles: towns, tiers of the benchmark, and their sealed tests."""

ENOUGH: Final = 100
"""Minimum number of sessions of a row that is compared, as in `submission.LeaderboardProtocol`."""

_KINDS: Final = (*(kind.name.lower() for kind in ExceptionKind if kind is not ExceptionKind.NONE), NO_EXCEPTION)

PAGE_METRICS: Final = (
    "talk_success", "unnecessary_questions", "timely_completion", "all_trials",
    "success", "goal_condition_success", "spl", "route_completion", "infraction_score", "driving_score", "seconds",
    "exchanges_per_subgoal", "clarification_rate", "exceptions_recovered", "recovery_seconds",
)  # fmt: skip
"""Keys of the metrics on the page; those that need references or trials are left out of parts without them."""

_IN_TABLES: Final = (Claim.FIGURES, Claim.NAME, Claim.WEIGHTS, Claim.LANGUAGE_MODEL, Claim.PERSONA, Claim.DATES)
"""Claims in the column of the tables of figures; other claims have columns of their own, whose titles say so."""

CLAIMED: Final = "claimed"
"""Title of that column, and mark of the columns that are claims."""


@dataclass(frozen=True, kw_only=True)
class LeaderboardEntry:
    """Rollout on the leaderboard.

    Attributes:
        folder: folder of the rollout.
        result: result of the rollout.
        table: table of the result.
        cost: `wall_seconds`, `cpu_seconds` and `workers` of the rollout; empty if unknown.
        check: outcome of the check of all sessions, without faults; None if they were not checked.
    """

    folder: Path
    result: RolloutResult
    table: RolloutTable
    cost: Mapping[str, float]
    check: SubmissionCheck | None = None

    @property
    def claims(self) -> tuple[Claim, ...]:
        """Unchecked statements in the files of a rollout."""
        if self.check is not None:
            return self.check.claims
        usage, run_time = bool(self.result.usage()), bool(self.cost)
        return claims_of(self.result.settings, checked=False, played=False, usage=usage, run_time=run_time)

    @property
    def policy(self) -> str:
        """Name of the row: the Co-Wizard, and what is unusual: other roles, words, perception, time, trials."""
        settings, usual = self.result.settings, usual_settings(self.result.settings)
        config = settings["config"]
        name = str(settings[str(Role.CO_WIZARD)])
        others = [f"tier {settings['tier']}"] if "tier" in settings.keys() - usual.keys() else []
        others += ["oracle"] if settings.get("oracle") else []
        others += [
            f"{role.value.replace('_', '-')} {settings[str(role)]}"
            for role in (Role.PARTICIPANT, Role.AD_WIZARD)
            if settings[str(role)] != usual[str(role)]
        ]
        if is_given(config, usual["config"], "word_error_rate"):
            others.append(f"word errors {100 * config['word_error_rate']:g} %")
        if perception := config.get("perception"):
            others.append(f"perception {perception}")
        if (channel := config.get("channel")) and channel != usual["config"].get("channel"):
            others.append(f"channel {channel}")
        if beacon := settings.get("beacon"):
            others.append(f"beacon {beacon['text']} of {beacon['date']}")
        elif "tier" in usual and settings["towns"] != usual["towns"]:
            others.append(f"towns {towns_text(settings['towns'])}")
        if trials := settings.get("trials"):
            others.append(f"{trials} trials")
        if self.shortened:
            others.append(f"sessions of at most {self.time_limit:g} s")
        if self.silent:
            others.append("silent in many calls")
        return f"{name} ({', '.join(others)})" if others else name

    @property
    def label(self) -> str:
        """Short name of the row: of a model, its name instead of the path of its folder."""
        path = str(self.result.settings[str(Role.CO_WIZARD)])
        return self.policy.replace(path, model_name(path), 1)

    @property
    def time_limit(self) -> float:
        """Time after which sessions were truncated [s]."""
        return float(self.result.settings["config"]["max_seconds"])

    @property
    def shortened(self) -> bool:
        """Whether sessions were truncated earlier than usual."""
        return self.time_limit < float(usual_settings(self.result.settings)["config"]["max_seconds"])

    @property
    def silent(self) -> bool:
        """Whether a language model left more of its calls unanswered than `usage.SILENT_SHARE`."""
        return not all(usage.mostly_answered for usage in self.result.usage().values())

    @property
    def part(self) -> str:
        """Part of the page, a key of `PART_TITLES`."""
        towns, usual = self.result.settings["towns"], usual_settings(self.result.settings)
        if "tier" in usual:
            return str(part_of(self.result.settings))
        imported = all(split_lights(str(town))[0].lower().endswith(".xodr") for town in towns)
        return fold_of_towns(towns) or (IMPORTED if imported else OTHER)

    @property
    def rank(self) -> tuple[bool, float, float, str]:
        """Sort key: neither shortened nor silent first; success, then driving score, best first; then the name.

        In a tier, timely completion is in place of success, or the share of right reactions in one of talk.
        """
        tier = TIERS.get(str(self.result.settings.get("tier")))
        headline = "success" if tier is None else "timely_completion" if tier.config.talk is None else "talk_success"
        keys = (headline, "driving_score")
        first, second = (self.table.figures[key]["mean"] for key in keys)
        return self.shortened or self.silent, -(first or 0.0), -(second or 0.0), self.policy


def read_entries(folders: Sequence[Path | str]) -> tuple[LeaderboardEntry, ...]:
    """Reads the results of rollouts, in order of parts and ranks.

    Args:
        folders: folders of rollouts, or folders that contain them.

    Raises:
        RolloutError: there is no result, one is damaged, or two are of the same policy and part.
    """
    entries: dict[tuple[str, str], LeaderboardEntry] = {}
    for folder in _with_results(folders):
        entry = _read(folder)
        other = entries.setdefault((entry.part, entry.policy), entry)
        if other is not entry:
            raise RolloutError(
                f"{folder}: {entry.policy} in {PART_TITLES[entry.part].lower()} is also in {other.folder}; give one"
            )
    order = list(PART_TITLES)
    return tuple(sorted(entries.values(), key=lambda entry: (order.index(entry.part), entry.rank)))


def checked_entries(
    entries: Sequence[LeaderboardEntry],
    protocol: LeaderboardProtocol,
    *,
    workers: int = 1,
    on_session: Callable[[int, int], None] | None = None,
) -> tuple[LeaderboardEntry, ...]:
    """Returns rollouts with the outcome of the check of all their sessions, in the same order.

    Rollouts of another protocol, such as those in imported towns, are returned unchanged: their figures remain claims.

    Args:
        entries: the rollouts.
        protocol: protocol of the leaderboard.
        workers: number of processes, as in `check_submission`.
        on_session: called with the numbers of checked sessions and of all sessions to check, over all rollouts.

    Raises:
        RolloutError: a rollout has faults.
        ProcessError: a process died.
    """
    due = [entry for entry in entries if not any(protocol.faults(entry.result.settings))]
    total, done_before, found = sum(len(entry.result.rows) for entry in due), 0, dict[Path, SubmissionCheck]()
    for entry in due:
        before = done_before

        def report(done: int, _: int, before: int = before) -> None:
            if on_session is not None:
                on_session(before + done, total)

        check = check_submission(entry.folder, protocol=protocol, workers=workers, on_session=report)
        if check.faults:
            more = f", and {len(check.faults) - 1} more faults" if len(check.faults) > 1 else ""
            raise RolloutError(
                f"{entry.folder}: {check.faults[0]}{more}; see `dorothie-gym submit {entry.folder}`, or leave it out"
            )
        found[entry.folder] = check
        done_before += len(entry.result.rows)
    return tuple(replace(entry, check=found.get(entry.folder)) for entry in entries)


def labels_of(entries: Sequence[LeaderboardEntry]) -> dict[str, str]:
    """Returns the short name of each policy; policies with equal short names keep their paths."""
    short = {entry.policy: entry.label for entry in entries}
    names = list(short.values())
    return {policy: label if names.count(label) == 1 else policy for policy, label in short.items()}


_FOLDERS: Final = ("runs", "models", "best", "last", "small", "paper")
"""Folders in the path of a model that do not name it."""


def model_name(path: str) -> str:
    """Returns the name of a model from its path: "reader, seed 0" for models/reader/small/seed-0."""
    parts = [part for part in PurePath(path.replace("\\", "/")).parts if part not in ("/", ".", "..")]
    if len(parts) < 2:
        return path
    seeds = [part.replace("-", " ") for part in parts if re.fullmatch(r"seed-\d+", part)]
    names = [part for part in parts if part not in _FOLDERS and not re.fullmatch(r"seed-\d+", part)]
    return ", ".join([*(names or parts)[-1:], *seeds[-1:]])


def leaderboard_page(
    entries: Sequence[LeaderboardEntry], picture: str | None = None, definitions: str | None = None
) -> str:
    """Returns the leaderboard as Markdown.

    Args:
        entries: the rollouts, in order.
        picture: name of the picture next to the page, or None.
        definitions: page with the definitions of the metrics, as seen from this page, or None.
    """
    where = (
        "`docs/closed-loop.md` of dorothie_gym" if definitions is None else f"[Closed-loop evaluation]({definitions})"
    )
    lines = [
        "# Leaderboard",
        "",
        "This page is generated by `dorothie-gym leaderboard` from the results of `dorothie-gym rollout`. Values are",
        "means over sessions with 95 % intervals; sessions that ended in an error count as failures. The columns and",
        f"the intervals are defined in {where}.",
        "",
        f"`{CLAIMED}` names what the files of a rollout state and nothing has checked. With `--check`, all sessions",
        "of a row are played again, as by `dorothie-gym submit`, and its figures are no claim. A name is none if the",
        "package has the policy, which is then played again, too. The cost of training and running, and the usage of",
        "language models, are always claims.",
    ]
    if any(entry.shortened for entry in entries):
        in_tiers = any(entry.result.settings.get("tier") for entry in entries)
        usual = f"{EnvConfig().max_seconds:g} s{' or those of their tier' if in_tiers else ''}"
        lines += [
            "",
            f"Rollouts with sessions shorter than {usual} are marked and ranked after the others:",
            "a session that is cut off can reach fewer subgoals, and meets fewer difficulties.",
        ]
    if any(entry.silent for entry in entries):
        lines += [
            "",
            f"Rollouts in which more than {100 * SILENT_SHARE:g} % of the calls of a language model ended in a silent",
            "action are marked and ranked after the others: they do not show what the model can do.",
        ]
    if any(len(entry.result.rows) < ENOUGH for entry in entries):
        lines += ["", f"Rows of fewer than {ENOUGH} sessions have wide intervals; they are no basis for a ranking."]
    labels = labels_of(entries)
    if picture is not None:
        lines += ["", f"![Success and driving score of each policy, with intervals]({picture})"]
    for part, title in PART_TITLES.items():
        chosen = [entry for entry in entries if entry.part == part]
        if chosen:
            lines += ["", f"## {title}", "", *_figures(chosen, labels)]
    lines += _by_exception(entries, labels)
    lines += [
        "",
        "## Cost",
        "",
        *_costs(entries, labels),
        "",
        *_language_models(entries, labels),
        "## Commands",
        "",
        "These commands reproduce the tables but for times, which depend on the machine. The SHA-256 of all figures",
        "and of the sessions that they come from is equal on any machine:",
        "",
        f"`{figures_sha256(entries)}`",
        "",
    ]
    lines += ["```bash", *(printable(command_of(entry.result.settings)) for entry in entries), "```", ""]
    return "\n".join(lines)


def _figures(entries: Sequence[LeaderboardEntry], labels: Mapping[str, str]) -> list[str]:
    tables = {entry.policy: entry.table for entry in entries}
    metrics: list[ShownMetric] = [next(metric for metric in ALL_METRICS if metric.key == key) for key in PAGE_METRICS]
    columns = [metric for metric in metrics if not (metric.optional and is_undefined(metric, tables))]
    rows = [["Co-Wizard", "sessions", "errored", CLAIMED, *(metric.title for metric in columns)]]
    for entry in entries:
        cells = [figure_text(metric, entry.table.figures[metric.key]) for metric in columns]
        part = "" if entry.result.complete else f" of {entry.result.settings['sessions_planned']}"
        claims = ", ".join(claim for claim in entry.claims if claim in _IN_TABLES) or "-"
        rows.append(
            [_name(labels[entry.policy]), f"{entry.table.sessions}{part}", str(entry.table.errored), claims, *cells]
        )
    return _table(rows)


def _by_exception(entries: Sequence[LeaderboardEntry], labels: Mapping[str, str]) -> list[str]:
    """Returns the section on success in the sessions with each kind of exception; empty for no sessions."""
    success = next(metric for metric in ALL_METRICS if metric.key == "success")
    lines = [
        "",
        "## Success by exception",
        "",
        "Success in the sessions in which an exception of a kind occurred, and their number; a session with several",
        f"kinds counts for each. `{NO_EXCEPTION}`: sessions without exceptions.",
    ]
    for part, title in PART_TITLES.items():
        tables = {entry.policy: entry.result.per_exception() for entry in entries if entry.part == part}
        kinds = [kind for kind in _KINDS if any(kind in table for table in tables.values())]
        if not kinds:
            continue
        rows = [["Co-Wizard", *(kind.replace("_", " ") for kind in kinds)]]
        for policy, found in tables.items():
            cells = [
                f"{figure_text(success, found[kind].figures['success'])} of {found[kind].sessions}"
                if kind in found
                else "-"
                for kind in kinds
            ]
            rows.append([_name(labels[policy]), *cells])
        lines += ["", f"### {title}, by exception", "", *_table(rows)]
    return lines if len(lines) > 5 else []


def figures_sha256(entries: Sequence[LeaderboardEntry]) -> str:
    """Returns the hash of the content of a leaderboard's rows: policies, weights, sessions, measures; no times."""
    pages = []
    for entry in entries:
        settings = entry.result.settings
        towns = [PurePath(str(town).replace("\\", "/")).stem for town in settings["towns"]]
        rows = [{**row.to_json(), "town": PurePath(row.town.replace("\\", "/")).stem} for row in entry.result.rows]
        pages.append(
            {
                "policy": entry.label,
                "sha256": settings.get("sha256", {}),
                "towns": towns,
                "seed": settings["seed"],
                "config": settings["config"],
                **{name: settings[name] for name in ("beacon", "seal") if name in settings},
                "rows": [{**row, "usage": None} for row in rows],
            }
        )
    return hashlib.sha256(json.dumps(pages, sort_keys=True).encode()).hexdigest()


def _costs(entries: Sequence[LeaderboardEntry], labels: Mapping[str, str]) -> list[str]:
    times = [f"{name} ({CLAIMED})" for name in ("training steps", "training time", "wall time", "processor time")]
    rows = [["Co-Wizard", "towns", *times[:2], "decisions", *times[2:]]]
    for entry in entries:
        training = entry.result.settings.get("training", {}).get(str(Role.CO_WIZARD), {})
        workers = entry.cost.get("workers")
        rows.append(
            [
                _name(labels[entry.policy]),
                entry.part,
                f"{training['steps']:,.0f}" if "steps" in training else "-",
                _time(training.get("seconds")),
                f"{entry.table.decisions:,}",
                _time(entry.cost.get("wall_seconds")) + (f" by {workers:g}" if workers else ""),
                _time(entry.cost.get("cpu_seconds")),
            ]
        )
    return _table(rows)


def _language_models(entries: Sequence[LeaderboardEntry], labels: Mapping[str, str]) -> list[str]:
    """Returns the section on the usage of language models; empty for rollouts without any."""
    rows = [["Co-Wizard", "towns", "role", "calls", "answered", "tokens in, out", "seconds / call", "cost / session"]]
    for entry in entries:
        for role, usage in entry.result.usage().items():
            calls = max(usage.calls, 1)
            rows.append(
                [
                    _name(labels[entry.policy]),
                    entry.part,
                    role.replace("_", "-"),
                    f"{usage.calls:,}",
                    f"{100 * usage.answers / calls:.1f} %{'' if usage.mostly_answered else ' (!)'}",
                    tokens_text(usage),
                    f"{usage.latency / calls:.2f}",
                    "-" if usage.cost is None else f"{usage.cost / max(entry.table.sessions, 1):.4f} $",
                ]
            )
    return [f"## Language models ({CLAIMED})", "", *_table(rows), ""] if len(rows) > 1 else []


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return [lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]


def _name(label: str) -> str:
    """Returns a name as text of a Markdown page: untrusted names must not become links, pictures or tags."""
    return re.sub(r"([\\`*\[\]])", r"\\\1", printable(label)).replace("<", "&lt;")


def _time(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    return f"{seconds:.0f} s" if seconds < 600 else f"{seconds / 60:.0f} min"


def _with_results(folders: Sequence[Path | str]) -> list[Path]:
    found: list[Path] = []
    for given in map(Path, folders):
        here = [given] if (given / RESULT_FILE).is_file() else sorted(p.parent for p in given.glob(f"*/{RESULT_FILE}"))
        if not here:
            raise RolloutError(f"{given}: has no {RESULT_FILE}; write one with `dorothie-gym rollout --out {given}`")
        found += [folder for folder in here if folder not in found]
    return found


def _read(folder: Path) -> LeaderboardEntry:
    result = read_result(folder)
    file = folder / COST_FILE
    with raising(lambda message: RolloutError(f"{message}; remove the file, and run the rollout again")):
        page = read_json(file, MAX_SMALL_JSON) if file.exists() else {}
        cost = checked(page, dict[str, Amount], file)
    return LeaderboardEntry(folder=folder, result=result, table=result.table(), cost=cost)
