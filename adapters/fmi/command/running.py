"""`nlosim fmu run`: one FMU, its inputs from a table, its outputs as results."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import yaml

from adapters.fmi.command.inputs import Inputs, table_of_inputs
from adapters.fmi.command.interface import RunError, interface_options, used_text
from adapters.fmi.command.table import (
    Results,
    TableError,
    draw,
    lines_of_text,
    read_results,
    summary,
    write_results,
)
from adapters.fmi.component_type import FmuComponentType
from adapters.fmi.experiment import DefaultExperiment, default_experiment
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.cli.failures import outcome_of
from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.watch import WATCH
from orchestrator.component import Component
from orchestrator.early_end import EarlyEnd
from orchestrator.errors import CosimError
from orchestrator.last_call import noting
from orchestrator.observer import NoProgress, Observer, progress_meter
from orchestrator.parameters import ComponentType
from orchestrator.recording import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.scenario.conversion import Conversion
from orchestrator.scratch import scratch
from orchestrator.signal import Array, Causality, Connector
from orchestrator.simulation import simulate
from orchestrator.suggestion import suggestion
from orchestrator.system import Connection, Endpoint, System
from orchestrator.table_files import NO_PARQUET, has_parquet
from orchestrator.timebase import CommunicationGrid, Duration, Time, nanoseconds

_FMU: Final = "fmu"
_INPUTS: Final = "inputs"
_STEPS: Final = 500
"""How many there are in a run whose FMU does not say a step size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Communication points of a run.

    Attributes:
        start, stop: the first and the last one [ns].
        step: between two of them [ns].
    """

    start: Time
    stop: Time
    step: Duration


@dataclass(frozen=True, slots=True)
class Simulated:
    """A run.

    Attributes:
        results: of the outputs; up to where it failed, if it did.
        error: what it failed of.
        early_end: why it ended before its stop time without failing.
    """

    results: Results
    error: BaseException | None
    early_end: EarlyEnd | None = None


def run(arguments: Namespace) -> Outcome:
    """Simulate an FMU as the command line says."""
    problems = list(_file_problems(arguments))
    if problems:
        return failure("usage", Exit.WRONG_INPUT, "\n".join(problems))
    try:
        type_ = FmuComponentType(arguments.path, never_returns=True)
        options = interface_options(arguments, type_)
        found = default_experiment(arguments.path)
        given = (arguments.start_time, arguments.stop_time, arguments.step)
        span = span_of(found, *given)
        simulated = simulated_fmu(
            type_,
            span,
            starts=arguments.starts,
            options=options,
            table=arguments.input,
            record=arguments.record,
            quiet=arguments.quiet,
        )
    except (CosimError, OSError) as error:
        return outcome_of(error)
    results, lines, files = simulated.results, [], []
    if arguments.output is not None:
        write_results(results, arguments.output)
        files.append(arguments.output)
    if arguments.plot == "terminal":
        lines.append(lines_of_text(results))
    elif arguments.plot is not None and results.columns:
        draw(results, Path(arguments.plot))
        files.append(Path(arguments.plot))
    if simulated.error is not None:
        outcome = outcome_of(simulated.error)
        until = f"\nresults until then: {', '.join(map(str, files))}" if files else ""
        return Outcome(text=outcome.text + until, data=outcome.data, exit_code=outcome.exit_code)
    rows, early = len(results.times), simulated.early_end
    lines += [summary(results), "", f"{rows} rows, {_steps_text(span)}{used_text(type_, options)}"]
    lines += [] if early is None else [f"ended early: {early.text}"]
    lines += [f"wrote {', '.join(map(str, files))}"] if files else []
    data = {
        "start_s": span.start / 1e9,
        "stop_s": span.stop / 1e9,
        "step_s": span.step / 1e9,
        "ended_early": None if early is None else early.text,
        "rows": rows,
        "last": {name: np.asarray(c[-1]).tolist() for name, c in results.columns.items()},
        "files": [str(path) for path in files],
    }
    return Outcome(text="\n".join(lines), data=data)


def _steps_text(span: Span) -> str:
    start, stop, step = (ns / 1e9 for ns in (span.start, span.stop, span.step))
    count = (span.stop - span.start) // span.step
    return f"{start:g} to {stop:g} s in {count} steps of {step:g} s"


def _file_problems(arguments: Namespace) -> list[str]:
    """What cannot be written, before anything is run."""
    problems = []
    if arguments.output is not None and arguments.output.suffix not in {".csv", ".parquet"}:
        problems.append(f"--output {arguments.output}: write a name that ends in .csv or .parquet")
    elif arguments.output is not None and arguments.output.suffix != ".csv" and not has_parquet():
        problems.append(f"--output {arguments.output}: {NO_PARQUET}")
    is_file = arguments.plot not in {None, "terminal"}
    if is_file and Path(arguments.plot).suffix not in {".svg", ".png"}:
        problems.append(f"--plot {arguments.plot}: write `terminal`, or a name in .svg or .png")
    return problems


def span_of(
    default: DefaultExperiment, start: str | None, stop: str | None, step: str | None
) -> Span:
    """The communication points that are asked for, and what the FMU says where nothing is.

    Args:
        default: of the FMU.
        start: the first one [s], or `None`.
        stop: the last one [s], or `None`.
        step: between two [s], or `None`.

    Raises:
        RunError: they do not fit together.
    """
    problems: list[str] = []
    begin = _time("--start-time", start, default.start or "0", problems)
    if stop is None and default.stop is None:
        stop = str(float(Fraction(begin, 10**9) + 1))
    end = _time("--stop-time", stop, default.stop, problems)
    if not problems and end <= begin:
        what = f"the run stops at {end / 1e9:g} s, not after its start at {begin / 1e9:g} s"
        problems.append(what)
    if problems:
        raise RunError("\n".join(problems))
    if step is None and default.step is None:
        even = Fraction(end - begin, _STEPS)
        if even.denominator != 1:
            raise RunError(f"{_STEPS} steps are no whole nanoseconds each; choose --step")
        return Span(start=begin, stop=end, step=int(even))
    size = _time("--step", step, default.step, problems)
    if not problems:
        try:
            CommunicationGrid.over(begin, end, size)
        except ValueError as error:
            problems.append(f"--step {size / 1e9:g}: {error}")
    if problems:
        raise RunError("\n".join(problems))
    return Span(start=begin, stop=end, step=size)


def _time(option: str, said: str | None, default: str | None, problems: list[str]) -> Time:
    text = default if said is None else said
    try:
        return nanoseconds(text or "")
    except (ValueError, ZeroDivisionError):
        of = option if said is not None else f"{option}: the default experiment says"
        problems.append(f"{of} {text!r}: write seconds, a whole number of nanoseconds")
        return 0


def simulated_fmu(
    type_: ComponentType,
    span: Span,
    *,
    starts: Sequence[str] = (),
    options: Mapping[str, Any] = MappingProxyType({}),
    table: Path | None = None,
    record: Sequence[str] = (),
    quiet: bool = True,
) -> Simulated:
    """Simulate one FMU.

    Args:
        type_: of the FMU.
        span: its communication points.
        starts: `NAME=VALUE` of parameters and inputs.
        options: further parameters, converted.
        table: of inputs over time.
        record: patterns of outputs; all if there are none.
        quiet: draw no progress bar.

    Raises:
        RunError: a start value, or what is to be recorded, is wrong.
        TableError: the table is.
        CosimError: the FMU cannot be run, or recorded.
    """
    values, held = _start_values(type_, starts)
    component = type_.create(_FMU, {**values, **options})
    outputs = _recorded(component.connectors, record)
    source = _source(component.connectors, held, table)
    components: dict[str, Component] = {_FMU: component}
    connections: list[Connection] = []
    if source is not None:
        components = {_INPUTS: source, _FMU: component}
        ends = ((Endpoint(_INPUTS, n), Endpoint(_FMU, n)) for n in source.connectors)
        connections = [Connection(*pair) for pair in ends]
    system = System(components, dict.fromkeys(components, span.step), connections)
    with (
        scratch("fmu-run") as folder,
        noting(folder, tuple(components)) as last_call,
        stopping() as stop,
    ):
        WATCH.begin(folder)
        meter = NoProgress() if quiet else progress_meter()
        recorder = Recorder(folder, include=[f"{_FMU}.{output}" for output in outputs])
        observers: list[Observer] = [recorder, meter, stop]
        error: BaseException | None = None
        early_end: EarlyEnd | None = None
        try:
            early_end = simulate(
                system,
                Jacobi(),
                start=span.start,
                stop=span.stop,
                seed=0,
                observers=observers,
                last_call=last_call,
            ).early_end
        except (CosimError, KeyboardInterrupt) as raised:
            error = raised
        return Simulated(_results(folder, outputs, component.connectors), error, early_end)


def _start_values(
    type_: ComponentType, starts: Sequence[str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Those of parameters, converted, and what is said of everything else."""
    problems: list[str] = []
    said: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for text in starts:
        name, equals, value = text.partition("=")
        if not equals:
            problems.append(f"--start-value {text}: write NAME=VALUE")
            continue
        try:
            parsed = yaml.safe_load(value)
        except yaml.YAMLError:
            parsed = value
        (said if name in type_.parameters else others)[name] = parsed
    conversion = Conversion(lambda _: Path.cwd())
    values = conversion.parameters(type_.parameters, said)
    problems += [f"--start-value {p.address[0]}: {p.what}" for p in conversion.problems]
    if problems:
        raise RunError("\n".join(problems))
    return values, others


def _recorded(connectors: Mapping[str, Connector], record: Sequence[str]) -> list[str]:
    outputs = [
        name
        for name, c in connectors.items()
        if c.causality is Causality.OUTPUT
        and not c.is_binary
        and all(isinstance(n, int) for n in c.shape)
    ]
    problems = [
        f"--record {pattern}: no output matches; {suggestion(pattern, outputs)}"
        for pattern in record
        if not any(fnmatchcase(name, pattern) for name in outputs)
    ]
    if problems:
        raise RunError("\n".join(problems))
    if not outputs:
        raise RunError("the FMU has no outputs that can stand in a table")
    return [n for n in outputs if not record or any(fnmatchcase(n, p) for p in record)]


def _source(
    connectors: Mapping[str, Connector], held: Mapping[str, Any], table: Path | None
) -> Inputs | None:
    inputs = [name for name, c in connectors.items() if c.causality is Causality.INPUT]
    problems = []
    columns: dict[str, Array] = {}
    for name, value in held.items():
        if name not in inputs:
            hint = suggestion(name, inputs)
            problems.append(f"--start-value {name}: there is no such parameter or input; {hint}")
            continue
        try:
            columns[name] = np.asarray(value, np.float64)[np.newaxis]
        except (TypeError, ValueError):
            problems.append(f"--start-value {name}: {value!r} is no number")
    if problems:
        raise RunError("\n".join(problems))
    path, driven = Path("--start-value"), Results(np.zeros(1), columns, {})
    if table is not None:
        path, found = table, read_results(table)
        held_columns = {n: np.repeat(c, len(found.times), axis=0) for n, c in columns.items()}
        driven = Results(found.times, {**held_columns, **found.columns}, {})
    if not driven.columns:
        return None
    return Inputs(table_of_inputs(path, driven, connectors), driven)


def _results(folder: Path, outputs: Sequence[str], connectors: Mapping[str, Connector]) -> Results:
    """What was recorded until the run ended, or failed."""
    try:
        recording = Recording(folder)
        series = {name: recording[f"{_FMU}.{name}"] for name in outputs}
    except CosimError:
        return Results(np.empty(0), {}, {})
    times = next(iter(series.values())).times * 1e-9
    columns = {name: np.asarray(each.values) for name, each in series.items()}
    # what is fixed was recorded once
    columns = {n: c if len(c) == len(times) else np.repeat(c, len(times), axis=0)
               for n, c in columns.items()}  # fmt: skip
    return Results(times, columns, {n: connectors[n].unit for n in outputs})


__all__ = ["RunError", "Simulated", "Span", "TableError", "run", "simulated_fmu", "span_of"]
