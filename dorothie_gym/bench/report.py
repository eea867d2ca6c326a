"""Summaries of measurements, as text and as the rows of tables and charts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.sim.config import FRAME_RATE


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One speed or time that was measured.

    Attributes:
        label: of what.
        value: in the unit of the report; the median of the repeats.
        spread: interquartile range over the median, or None where it is not known.
        best: of the repeats, or None.
        reference: whether it is what ours is held against.
    """

    label: str
    value: float
    spread: float | None = None
    best: float | None = None
    reference: bool = False


@dataclass(frozen=True, kw_only=True)
class Mark:
    """A value on the scale of a report that tells how the rows are to be read."""

    label: str
    value: float


@dataclass(frozen=True, kw_only=True)
class Report:
    """A measurement, as a person reads it.

    Attributes:
        title: what was measured.
        setting: on what.
        headline: what came out.
        unit: of all rows.
        rows: references first.
        mark: a line across the chart, or None.
        notes: what else is to be known, a line each.
        machine: what it was measured on.
        logarithmic: whether the values differ so much that a chart needs it.
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


def world_report(figures: Mapping[str, Any]) -> Report:
    """Returns the summary of `bench.world.measure`."""
    people = f"{_count(figures['vehicles'], 'vehicle')} ({_count(figures['cyclists'], 'cyclist')} among them)"
    there = f"{_count(figures['pedestrians'], 'pedestrian')}, {_count(figures['props'], 'prop')}"
    stock = figures["stock_substeps_per_second"]
    return Report(
        title="A world with everything on",
        setting=f"{figures['town']}: {figures['lanes']} lanes, {people}, {there}; one core",
        headline=f"{number(figures['ratio'])} times highway-env's own road on the same plan, "
        f"{number(figures['substeps_per_second'] / FRAME_RATE)} times real time",
        unit="substeps a second",
        rows=(
            Measurement(
                label=f"highway-env's road\n{_count(figures['vehicles'], 'IDM vehicle')}, nothing else",
                value=stock, spread=figures["stock_spread"], best=figures["stock_best"], reference=True,
            ),
            Measurement(
                label="dorothie_gym's world\ntraffic, people, lights, yielding, props",
                value=figures["substeps_per_second"], spread=figures["spread"], best=figures["best"],
            ),
        ),
        mark=Mark(label="real time", value=FRAME_RATE),
        notes=(f"one more world in the same town takes {figures['bytes_per_world'] / 1024:.0f} KiB",),
        machine=machine_line(figures["machine"]),
    )  # fmt: skip


def env_report(figures: Mapping[str, Any]) -> Report:
    """Words for `env.measure`."""
    simulated = figures["simulated_seconds_per_second"]
    rows = [
        Measurement(
            label="highway-env\nintersection-v0", value=figures["stock_simulated_seconds_per_second"],
            spread=figures["stock_spread"], reference=True,
        )
    ]  # fmt: skip
    sumo = figures["sumo_substeps_per_second"]
    if sumo is not None:
        label = "SUMO\nvehicles on a grid as large"
        rows.append(Measurement(label=label, value=sumo / FRAME_RATE, spread=figures["sumo_spread"], reference=True))
    step_share = simulated / figures["steps_per_second"]
    rows.append(
        Measurement(
            label="DuoWizardEnv\nthree agents observed in full", value=simulated, spread=figures["spread"],
            best=figures["best"] * step_share,
        )
    )  # fmt: skip
    scaling = figures["two_processes_scaling"]
    notes = [
        f"{number(figures['steps_per_second'])} steps a second of {figures['substeps_per_step']} substeps; "
        f"intersection-v0: {number(figures['stock_steps_per_second'])}",
        "two processes were not measured: there is one core only"
        if scaling is None
        else f"two processes do {scaling:.2f} times as much as one",
    ]
    if figures["sumo_missing"] is not None:
        notes.append(figures["sumo_missing"])
    return Report(
        title="The environment of three agents",
        setting=f"{figures['town']}: {figures['lanes']} lanes, {_count(figures['vehicles'], 'vehicle')}, "
        f"{_count(figures['pedestrians'], 'pedestrian')}; one core",
        headline=f"{number(figures['ratio'])} times as much simulated time as intersection-v0",
        unit="simulated seconds a second",
        rows=tuple(rows),
        mark=Mark(label="real time", value=1.0),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
    )


def vector_report(figures: Mapping[str, Any]) -> Report:
    """Words for `vector.measure` with the machine."""
    threads = _count(figures["threads"], "thread")
    notes = [f"the threads had {figures['processors']:.2f} processors to themselves"]
    if "vector_steps_per_second" in figures:
        vector, sync, processes = (number(figures[f"{way}_steps_per_second"]) for way in ("vector", "sync", "async"))
        notes.append(
            f"Town-v0, environments together: {vector} steps a second in one batch, {sync} by SyncVectorEnv, "
            f"{processes} by AsyncVectorEnv"
        )
    return Report(
        title="Many worlds in one call",
        setting=f"{figures['town']}: {_count(figures['worlds'], 'world')} "
        f"with {_count(figures['vehicles'], 'vehicle')} and {_count(figures['pedestrians'], 'pedestrian')} each",
        headline=f"{threads} do {figures['scaling']:.2f} times as much as one",
        unit="substeps a second, all worlds together",
        rows=(
            Measurement(label="one thread", value=figures["substeps_per_second_one_thread"], reference=True),
            Measurement(label=threads, value=figures["substeps_per_second"]),
        ),
        notes=tuple(notes),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def import_report(figures: Mapping[str, Any]) -> Report:
    """Words for `importing.measure`."""
    seconds, stock = figures["seconds"], figures["highway_env_seconds"]
    return Report(
        title="From nothing to a first environment",
        setting=f"{figures['town']}; fresh processes, caches warm",
        headline=f"a first environment takes {figures['ratio']:.2f} times as long as importing highway-env",
        unit="seconds",
        rows=(
            Measurement(label="import highway_env", value=stock, spread=figures["highway_env_spread"], reference=True),
            Measurement(label="import dorothie_gym", value=seconds["package"], spread=figures["package_spread"]),
            Measurement(label="... and make and reset\na first environment", value=seconds["first_environment"],
                spread=figures["spread"]),
            Measurement(label="... and its first step", value=seconds["first_step"]),
        ),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )  # fmt: skip


def rl_report(figures: Mapping[str, Any]) -> Report:
    """Words for `baselines.rl.measuring.measure`."""
    names = {
        "environment": "physics and observations", "partners": "instructor and Ad-Wizard",
        "policy": "choosing actions", "learner": "learning",
    }  # fmt: skip
    shares = ", ".join(f"{names[name]} {100 * share:.0f} %" for name, share in figures["shares"].items())
    rows = [
        Measurement(label="one process\nfor environments and learner", value=figures["one_process_steps_per_second"])
    ]
    if figures["workers_steps_per_second"] is not None:
        label = f"{_count(figures['workers'], 'worker')} beside the learner\nfor the environments"
        rows.append(Measurement(label=label, value=figures["workers_steps_per_second"]))
    return Report(
        title=f"Training {figures['algorithm']} on {figures['env']}",
        setting=f"{_count(figures['environments'], 'environment')}, network {figures['network']}, "
        f"{figures['steps']:,} steps each",
        headline=f"{number(figures['steps_per_second'])} environment steps a second end to end",
        unit="environment steps a second",
        rows=tuple(rows),
        mark=Mark(label="wanted on two cores", value=figures["target"]),
        notes=(f"in one process: {shares}",),
        machine=machine_line(figures["machine"]),
        logarithmic=False,
    )


def train_report(figures: Mapping[str, Any]) -> Report:
    """Words for the measurement of training (`baselines.bench.measure`)."""
    threads = _count(figures["threads"], "thread")
    giga = figures["flops_per_second"] / 1e9
    return Report(
        title="TOTO at the published size",
        setting=f"{figures['parameters'] / 1e6:.0f} million numbers, batches of {figures['batch_size']} points, up to "
        f"{figures['tokens']} tokens each; {threads}, float32",
        headline=f"training: {number(figures['ratio'])} times the published loop, "
        f"{figures['matrix_share']:.0%} of the machine's matrix rate",
        unit="points a second",
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
                label="published loop, answering", value=figures["published_inference_points_per_second"],
                reference=True,
            ),
            Measurement(label="TOTO, answering", value=figures["inference_points_per_second"]),
        ),
        notes=(
            f"answering: {number(figures['inference_ratio'])} times the published loop",
            f"{number(figures['flops_per_point'] / 1e9)} billion operations a point in training: {number(giga)} "
            f"billion a second, of {number(figures['matrix_flops_per_second'] / 1e9)} in products of large matrices",
            f"the published model has {figures['published_parameters'] / 1e6:.0f} million numbers",
        ),
        machine=f"{machine_line(figures['machine'])}, torch {figures['torch']}",
    )  # fmt: skip


def machine_line(machine: Mapping[str, Any]) -> str:
    """Returns the machine and versions of a measurement in one line."""
    return (
        f"{machine['processor']}, {_count(machine['cores'], 'core')}, {machine['system']}; Python {machine['python']}, "
        f"numba {machine['numba']}, numpy {machine['numpy']}, highway-env {machine['highway_env']}"
    )


def number(value: float) -> str:
    """A number to three digits or to the unit: "0.062", "3.39", "128,571"."""
    if value >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
