"""Summaries of measurements: headline, notes and rows, for tables and charts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from benchmarks.timing import Figures
from dorothie_gym.session.config import CameraOutput
from dorothie_gym.sim.config import FRAME_RATE


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """A measured speed or time.

    Attributes:
        label: name of the measured program.
        value: median of the repetitions, in the unit of the report.
        spread: interquartile range divided by the median, or None if it is unknown.
        best: best repetition, or None.
        reference: whether it is a reference and not of this package.
    """

    label: str
    value: float
    spread: float | None = None
    best: float | None = None
    reference: bool = False


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Value on the scale of a report that the rows are compared with."""

    label: str
    value: float


@dataclass(frozen=True, kw_only=True)
class Report:
    """Summary of a measurement.

    Attributes:
        title: subject of the measurement.
        setting: town and traffic.
        headline: main result.
        unit: unit of all rows.
        rows: references first.
        mark: line across the chart, or None.
        notes: further results, one line each.
        machine: machine and versions.
        logarithmic: whether the chart needs a logarithmic scale.
    """

    title: str
    setting: str
    headline: str
    unit: str
    rows: tuple[Measurement, ...]
    mark: Mark | None = None
    notes: tuple[str, ...] = ()
    machine: str
    logarithmic: bool = True


_PARTS_SHOWN: Final = 6
"""Number of the parts of a decision that are listed."""


def world_report(figures: Figures) -> Report:
    """Returns the summary of `world.measure`."""
    traffic = f"{_count(figures['vehicles'], 'vehicle')} ({_count(figures['cyclists'], 'cyclist')} among them)"
    others = f"{_count(figures['pedestrians'], 'pedestrian')}, {_count(figures['props'], 'prop')}"
    stock = figures["stock_substeps_per_second"]
    return Report(
        title="World with traffic, pedestrians, lights and props",
        setting=f"{figures['town']}: {figures['lanes']} lanes, {traffic}, {others}; one core",
        headline=f"{number(figures['ratio'])} times highway-env's own road on the same map, "
        f"{number(figures['substeps_per_second'] / FRAME_RATE)} times real time",
        unit="substeps per second",
        rows=(
            Measurement(
                label=f"highway-env's road\n{_count(figures['vehicles'], 'IDM vehicle')}, no other actors",
                value=stock,
                spread=figures["stock_spread"],
                best=figures["stock_best"],
                reference=True,
            ),
            Measurement(
                label="dorothie_gym's world\ntraffic, people, lights, yielding, props",
                value=figures["substeps_per_second"],
                spread=figures["spread"],
                best=figures["best"],
            ),
        ),
        mark=Mark(label="real time", value=FRAME_RATE),
        notes=(f"memory of one more world in the same town: {figures['bytes_per_world'] / 1024:.0f} KiB",),
        machine=machine_line(figures["machine"]),
    )


def env_report(figures: Figures) -> Report:
    """Returns the summary of `env.measure`."""
    simulated = figures["simulated_seconds_per_second"]
    rows = [
        Measurement(
            label="highway-env\nintersection-v0",
            value=figures["stock_simulated_seconds_per_second"],
            spread=figures["stock_spread"],
            reference=True,
        )
    ]
    sumo = figures["sumo_substeps_per_second"]
    if sumo is not None:
        label = "SUMO\nvehicles on a grid as large"
        rows.append(Measurement(label=label, value=sumo / FRAME_RATE, spread=figures["sumo_spread"], reference=True))
    step_share = simulated / figures["steps_per_second"]
    rows.append(
        Measurement(
            label="DuoWizardEnv\nthree agents, full observations",
            value=simulated,
            spread=figures["spread"],
            best=figures["best"] * step_share,
        )
    )
    scaling = figures["two_processes_scaling"]
    notes = [
        f"{number(figures['steps_per_second'])} steps per second of {figures['substeps_per_step']} substeps; "
        f"intersection-v0: {number(figures['stock_steps_per_second'])}",
        "two processes were not measured on a single core"
        if scaling is None
        else f"throughput of two processes: {scaling:.2f} times that of one",
    ]
    if figures["sumo_missing"] is not None:
        notes.append(figures["sumo_missing"])
    return Report(
        title="Environment of three agents",
        setting=f"{figures['town']}: {figures['lanes']} lanes, {_count(figures['vehicles'], 'vehicle')}, "
        f"{_count(figures['pedestrians'], 'pedestrian')}; one core",
        headline=f"{number(figures['ratio'])} times as much simulated time as intersection-v0",
        unit="simulated seconds per second",
        rows=tuple(rows),
        mark=Mark(label="real time", value=1.0),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
    )


def vector_report(figures: Figures) -> Report:
    """Returns the summary of `vector.measure`."""
    threads = _count(figures["threads"], "thread")
    notes = [f"processors available to the threads: {figures['processors']:.2f}"]
    if "vector_steps_per_second" in figures:
        vector, sync, processes = (number(figures[f"{mode}_steps_per_second"]) for mode in ("vector", "sync", "async"))
        notes.append(
            f"Navigation-v0, all environments: {vector} steps per second in one batch, {sync} by SyncVectorEnv, "
            f"{processes} by AsyncVectorEnv"
        )
    return Report(
        title="Batch of worlds",
        setting=f"{figures['town']}: {_count(figures['worlds'], 'world')} "
        f"with {_count(figures['vehicles'], 'vehicle')} and {_count(figures['pedestrians'], 'pedestrian')} each",
        headline=f"throughput of {threads}: {figures['scaling']:.2f} times that of one",
        unit="substeps per second, all worlds",
        rows=(
            Measurement(label="one thread", value=figures["substeps_per_second_one_thread"], reference=True),
            Measurement(label=threads, value=figures["substeps_per_second"]),
        ),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def import_report(figures: Figures) -> Report:
    """Returns the summary of `importing.measure`."""
    seconds, stock = figures["seconds"], figures["highway_env_seconds"]
    return Report(
        title="Import and first environment",
        setting=f"{figures['town']}; new processes, warm caches",
        headline=f"import and first environment take {figures['ratio']:.2f} times as long as importing highway-env",
        unit="seconds",
        rows=(
            Measurement(label="import highway_env", value=stock, spread=figures["highway_env_spread"], reference=True),
            Measurement(label="import dorothie_gym", value=seconds["package"], spread=figures["package_spread"]),
            Measurement(
                label="... and first environment,\nmade and reset",
                value=seconds["first_environment"],
                spread=figures["spread"],
            ),
            Measurement(label="... and its first step", value=seconds["first_step"]),
        ),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def rl_report(figures: Figures) -> Report:
    """Returns the summary of `baselines.rl.throughput.measure`."""
    names = {"environment": "environments", "policy": "action selection", "learner": "learning"}
    shares = ", ".join(f"{names[name]} {100 * share:.0f} %" for name, share in figures["shares"].items())
    rows = [
        Measurement(
            label=f"training with {figures['algorithm']}\nend to end", value=figures["end_to_end_steps_per_second"]
        )
    ]
    notes = [f"training: {shares}"]
    setting = f"{_count(figures['environments'], 'environment')}, network {figures['network']}"
    if figures["observation"] != "vector":
        setting += ", pictures"
    if figures["batch_steps_per_second"] is not None:
        rows = [
            Measurement(label="its physics alone", value=figures["kernel_steps_per_second"]),
            Measurement(
                label=f"batch of {figures['batch']}\non {_count(figures['threads'], 'thread')}",
                value=figures["batch_steps_per_second"],
            ),
            *rows,
            Measurement(label="one environment", value=figures["single_steps_per_second"]),
            Measurement(
                label="intersection-v0\nof highway-env", value=figures["stock_steps_per_second"], reference=True
            ),
        ]
        if figures["metadrive_steps_per_second"] is not None:
            rows.append(Measurement(label="MetaDrive", value=figures["metadrive_steps_per_second"], reference=True))
        parts = ", ".join(f"{name} {100 * share:.0f} %" for name, share in figures["step_shares"].items())
        notes.append(f"a step of the batch: {parts}; {figures['of_kernel']:.0%} of the rate of its physics")
        notes.append(f"memory: {figures['bytes_per_environment'] / 1024:.0f} KB an environment")
        setting += f"; {figures['town']}, {figures['traffic']} traffic, {figures['exceptions']:g} exceptions"
    return Report(
        title=f"Training {figures['algorithm']} on {figures['env']}",
        setting=setting,
        headline=f"{number(figures['end_to_end_steps_per_second'])} environment steps per second, end to end",
        unit="environment steps per second",
        rows=tuple(rows),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
    )


def camera_report(figures: Figures) -> Report:
    """Returns the summary of `camera.measure`."""
    rows = []
    if figures["metadrive"] is not None:
        value = 1000.0 / figures["metadrive"]["milliseconds"]
        rows.append(Measurement(label="MetaDrive, images\n480 x 320", value=value, reference=True))
    if figures["opengl"] is not None:
        value = 1000.0 / figures["opengl"]["milliseconds"]
        rows.append(Measurement(label="OpenGL, plain triangles\n480 x 320", value=value, reference=True))
    for row in figures["rows"]:
        parts = "everything" if len(row["outputs"]) == len(CameraOutput) else ", ".join(row["outputs"])
        smooth = "" if row["antialias"] else ", not smoothed"
        label = f"{row['width']} x {row['height']}, {parts}{smooth}\n{number(row['milliseconds'])} ms"
        rows.append(Measurement(label=f"{label}, p99 {number(row['milliseconds_p99'])}", value=_rate(row)))
    first = figures["rows"][0]
    cold = figures["cold_picture_seconds"]
    notes = [
        f"first picture: {number(figures['first_picture_seconds'])} s from caches"
        + ("" if cold is None else f", {number(cold)} s without"),
        f"memory: town {figures['town_bytes'] / 1e6:.1f} MB, camera {figures['camera_bytes'] / 1e6:.1f} MB",
        f"p99: along a drive of {_count(figures['drive_pictures'], 'picture')}",
    ]
    if figures["opengl"] is not None:
        notes.append(f"OpenGL: {figures['opengl']['renderer']}, without textures, shadows and bodies")
    if figures["metadrive"] is None:
        notes.append("MetaDrive or its assets are not installed")
    return Report(
        title="First-person camera",
        setting=f"{figures['town']}: {_count(figures['vehicles'], 'vehicle')}, "
        f"{_count(figures['pedestrians'], 'pedestrian')}, mean over {_count(figures['places'], 'place')}; one core",
        headline=f"{number(_rate(first))} pictures of {first['width']} x {first['height']} per second",
        unit="pictures per second",
        rows=tuple(rows),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
    )


def lidar_report(figures: Figures) -> Report:
    """Returns the summary of `lidar.measure`."""
    rows = []
    if figures["embree"] is not None:
        value = 1000.0 / figures["embree"]["milliseconds"]
        rows.append(Measurement(label="Embree, triangles only\n32 x 720", value=value, reference=True))
    for row in figures["rows"]:
        label = f"{row['channels']} x {row['columns']}\n{number(row['milliseconds'])} ms"
        label += f", slowest {number(row['milliseconds_worst'])}"
        rows.append(Measurement(label=label, value=_rate(row)))
    first = figures["rows"][0]
    return Report(
        title="Lidar",
        setting=f"{figures['town']}: {_count(figures['vehicles'], 'vehicle')}, "
        f"{_count(figures['pedestrians'], 'pedestrian')}, mean over {_count(figures['places'], 'place')}; one core",
        headline=f"{number(_rate(first))} turns of {first['channels']} x {first['columns']} rays per second",
        unit="turns per second",
        rows=tuple(rows),
        notes=() if figures["embree"] is not None else ("embreex is not installed",),
        machine=machine_line(figures["machine"]),
    )


def sessions_report(figures: Figures) -> Report:
    """Returns the summary of `sessions.measure`."""
    rows, notes = [], []
    for row in figures["rows"]:
        for build, found in (("", row["ours"]), (f"\nbuild {figures['against']}", row["theirs"])):
            if found is None:
                continue
            rows.append(
                Measurement(
                    label=f"Co-Wizard {row['co_wizard']}{build}",
                    value=found["decisions_per_second"],
                    spread=found["spread"],
                    best=found["best"],
                    reference=bool(build),
                )
            )
        parts = row["ours"]["milliseconds_by_part"]
        largest = ", ".join(f"{part} {number(1000.0 * value)}" for part, value in list(parts.items())[:_PARTS_SHOWN])
        notes.append(f"{row['co_wizard']}: {number(row['ours']['seconds_per_hour'])} s of processor time an hour")
        notes.append(f"largest parts of a decision [us]: {largest}")
        if figures["at_once"] > 1:
            notes[-2] += f", {number(row['ours']['megabytes_per_session'])} MB a session"
        if row["ratio"] is not None:
            notes[-2] += f"; {number(row['ratio'])} times the decisions per second of {figures['against']}"
    first = figures["rows"][0]
    return Report(
        title="Whole sessions with talk",
        setting=f"{_count(figures['sessions'], 'session')} in {', '.join(figures['towns'])}"
        + (", recorded" if figures["recorded"] else "")
        + (f", {figures['at_once']} at once" if figures["at_once"] > 1 else ""),
        headline=f"{number(first['ours']['decisions_per_second'])} decisions of all roles per second of processor time",
        unit="decisions per second",
        rows=tuple(rows),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def speech_report(figures: Figures) -> Report:
    """Returns the summary of `speech.measure`."""
    conditions = (("wer_clean", "without noise"), ("wer_20db", "pink noise, 20 dB"), ("wer_10db", "pink noise, 10 dB"))
    rows = [Measurement(label=label, value=100.0 * figures[name]) for name, label in conditions]
    return Report(
        title="Speech",
        setting=f"{_count(figures['spans'], 'span')} of {_count(figures['sessions'], 'session')}, "
        f"{figures['synthesizer']} and {figures['recognizer']}; one core",
        headline=f"word error rate {figures['wer_clean']:.1%} without noise",
        unit="word errors [percent]",
        rows=tuple(rows),
        notes=(
            f"slot values understood: F1 {figures['slots_f1']:.3f}, names {figures['names']:.1%}",
            f"moves understood: {figures['moves']:.1%}, and {figures['moves_written']:.1%} from the written words",
            f"recognition: {number(figures['recognition_rtf'])} s per second of audio",
            f"synthesis: {number(figures['synthesis_milliseconds'])} ms per span",
        ),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def understanding_report(figures: Figures) -> Report:
    """Returns the summary of `understanding.measure`."""
    written, misheard = figures["written"], figures["misheard"]["all"]
    rows = [
        Measurement(label=kind.replace("_", " "), value=100.0 * shares["first_move_and_slots"])
        for kind, shares in written["kinds"].items()
    ]
    found = written["all"]
    return Report(
        title="Understanding",
        setting=f"{_count(figures['sentences'], 'sentence')}, split {figures['split']}",
        headline=f"first move {found['first_move']:.1%}, first move and all slots {found['first_move_and_slots']:.1%}",
        unit="first move and all slots [percent]",
        rows=tuple(rows),
        notes=(
            f"slot values: F1 {found['slots_f1']:.3f}",
            f"plans: {found['plan']:.1%} equal, their steps F1 {found['steps_f1']:.3f}",
            f"with {figures['word_errors']:.0%} word errors: first move {misheard['first_move']:.1%}, "
            f"slot values F1 {misheard['slots_f1']:.3f}, plans {misheard['plan']:.1%}",
            f"time: {number(figures['milliseconds'])} ms per sentence",
        ),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def _rate(row: Figures) -> float:
    return float(1000.0 / row["milliseconds"])


def train_report(figures: Figures) -> Report:
    """Returns the summary of `baselines.bench.measure`."""
    threads = _count(figures["threads"], "thread")
    giga = figures["flops_per_second"] / 1e9
    return Report(
        title="TOTO at the published size",
        setting=f"{figures['parameters'] / 1e6:.0f} million parameters, batches of {figures['batch_size']} points, "
        f"up to {figures['tokens']} tokens each; {threads}, float32",
        headline=f"training: {number(figures['ratio'])} times the published loop, "
        f"{figures['matrix_share']:.0%} of the machine's matrix rate",
        unit="points per second",
        rows=(
            Measurement(
                label="published loop, training\none point at a time", value=figures["published_points_per_second"],
                spread=figures["published_spread"], best=figures["published_best"], reference=True,
            ),
            Measurement(
                label="TOTO, training", value=figures["points_per_second"], spread=figures["spread"],
                best=figures["best"],
            ),
            Measurement(
                label="published loop, inference", value=figures["published_inference_points_per_second"],
                reference=True,
            ),
            Measurement(label="TOTO, inference", value=figures["inference_points_per_second"]),
        ),
        notes=(
            f"inference: {number(figures['inference_ratio'])} times the published loop",
            f"{number(figures['flops_per_point'] / 1e9)} billion operations per point in training: {number(giga)} "
            f"billion per second, of {number(figures['matrix_flops_per_second'] / 1e9)} in products of large matrices",
            f"the published model has {figures['published_parameters'] / 1e6:.0f} million parameters",
        ),
        machine=f"{machine_line(figures['machine'])}, torch {figures['torch']}",
    )  # fmt: skip


def machine_line(machine: Figures) -> str:
    """Returns the machine and versions of a measurement in one line."""
    return (
        f"{machine['processor']}, {_count(machine['cores'], 'core')}, {machine['system']}; Python {machine['python']}, "
        f"numba {machine['numba']}, numpy {machine['numpy']}, highway-env {machine['highway_env']}"
    )


def number(value: float) -> str:
    """Returns a number with three digits, or rounded to the unit: "0.062", "3.39", "128,571"."""
    if value >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
