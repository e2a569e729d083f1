"""`nlosim fmu run`: one FMU, its inputs from a table, its outputs as results."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import yaml

from adapters.fmi.command.inputs import Inputs, in_units_of, table_of_inputs
from adapters.fmi.command.interface import interface_options, used_text
from adapters.fmi.command.reading import read_results
from adapters.fmi.command.span import RunError, Span, span_of
from adapters.fmi.command.table import (
    Results,
    draw,
    lines_of_text,
    summary,
    write_results,
)
from adapters.fmi.component_type import FmuComponentType
from adapters.fmi.experiment import default_experiment
from adapters.fmi.messages import shown
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
from orchestrator.patterns import meant
from orchestrator.recording import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.scenario.conversion import Conversion
from orchestrator.scratch import scratch
from orchestrator.signal import Array, Causality, Connector
from orchestrator.simulation import simulate
from orchestrator.suggestion import suggestion
from orchestrator.system import Connection, Endpoint, System
from orchestrator.table_files import NO_PARQUET, has_parquet
from orchestrator.timebase import format_duration
from orchestrator.units import number_in

_FMU: Final = "fmu"
_INPUTS: Final = "inputs"
_TERMINAL: Final = ("terminal", "-")
_LOCALS: Final = "fmi.locals"


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
        if problem := type_.step_problem(span.step):
            raise RunError(f"--step {float(span.step) / 1e9:g}: {problem}")
        with shown(verbose=arguments.logging):
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
    if arguments.plot in _TERMINAL:
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
        "step_s": float(span.step) / 1e9,
        "ended_early": None if early is None else early.text,
        "rows": rows,
        "last": {name: np.asarray(c[-1]).tolist() for name, c in results.columns.items()},
        "files": [str(path) for path in files],
    }
    return Outcome(text="\n".join(lines), data=data)


def _steps_text(span: Span) -> str:
    count = (span.stop - span.start) // span.step
    is_whole = isinstance(span.step, int)
    step = f"{span.step / 1e9:g} s" if is_whole else format_duration(span.step)
    return f"{span.start / 1e9:g} to {span.stop / 1e9:g} s in {count} steps of {step}"


def _file_problems(arguments: Namespace) -> list[str]:
    """What cannot be written, before anything is run."""
    problems = []
    if arguments.output is not None and arguments.output.suffix not in {".csv", ".parquet"}:
        problems.append(f"--output {arguments.output}: write a name that ends in .csv or .parquet")
    elif arguments.output is not None and arguments.output.suffix != ".csv" and not has_parquet():
        problems.append(f"--output {arguments.output}: {NO_PARQUET}")
    is_file = arguments.plot is not None and arguments.plot not in _TERMINAL
    if is_file and Path(arguments.plot).suffix not in {".svg", ".png"}:
        problems.append(f"--plot {arguments.plot}: write `terminal`, or a name in .svg or .png")
    return problems


def simulated_fmu(
    type_: FmuComponentType,
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
        starts: `NAME=VALUE` of parameters, inputs and other variables that have a start value.
        options: further parameters, converted.
        table: of inputs over time.
        record: patterns of outputs and of variables inside; all outputs if there are none.
        quiet: draw no progress bar.

    Raises:
        RunError: a start value, or what is to be recorded, is wrong.
        TableError: the table is.
        CosimError: the FMU cannot be run, or recorded.
    """
    values, held = _start_values(type_, starts)
    values |= _inner(type_, record)
    component = type_.create(_FMU, {**values, **options})
    outputs = _recorded(component.connectors, record, type_)
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


def _inner(type_: FmuComponentType, record: Sequence[str]) -> dict[str, Any]:
    """What makes outputs of variables inside: those that patterns mean that mean no output."""
    wanted = tuple(
        pattern
        for pattern in record
        if not meant(pattern, type_.outputs) and meant(pattern, type_.inner)
    )
    return {_LOCALS: wanted} if wanted and _LOCALS in type_.parameters else {}


def _start_values(
    type_: FmuComponentType, starts: Sequence[str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Those of parameters, states and the like, converted, and what is said of inputs."""
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
        names = [name] if name in type_.numbers else [name, f"start.{name}"]
        offered = [each for each in names if each in type_.parameters]
        if offered:
            said[offered[0]] = parsed
        elif name in type_.inputs:
            others[name] = parsed
        else:
            known = [*type_.inputs, *(each.removeprefix("start.") for each in type_.parameters)]
            hint = suggestion(name, dict.fromkeys(known))
            problems.append(f"--start-value {name}: there is no such parameter or input; {hint}")
    conversion = Conversion(lambda _: Path.cwd())
    values = conversion.parameters(type_.parameters, said)
    problems += [
        f"--start-value {str(p.address[0]).removeprefix('start.')}: {p.what}"
        for p in conversion.problems
    ]
    if problems:
        raise RunError("\n".join(problems))
    return values, others


def _recorded(
    connectors: Mapping[str, Connector], record: Sequence[str], type_: FmuComponentType
) -> list[str]:
    every = {n: c for n, c in connectors.items() if c.causality is Causality.OUTPUT}
    outputs = [
        name
        for name, c in every.items()
        if not c.is_binary and all(isinstance(n, int) or n in type_.settled_axes for n in c.shape)
    ]
    problems = [
        f"--record {pattern}: {_why_not(pattern, every, [*outputs, *type_.inner])}"
        for pattern in record
        if not meant(pattern, outputs)
    ]
    if problems:
        raise RunError("\n".join(problems))
    if not outputs:
        raise RunError("the FMU has no outputs that can stand in a table")
    wanted = {name for pattern in record for name in meant(pattern, outputs)}
    return [name for name in outputs if not record or name in wanted]


def _why_not(pattern: str, outputs: Mapping[str, Connector], offered: Sequence[str]) -> str:
    """Why nothing that a pattern means can stand in a table."""
    found = [f"`{name}` is {outputs[name].kind()}" for name in meant(pattern, outputs)]
    if found:
        return f"{', '.join(found)}, and a table has numbers, as many in each row"
    return f"no variable matches; {suggestion(pattern, offered)}"


def _source(
    connectors: Mapping[str, Connector], held: Mapping[str, Any], table: Path | None
) -> Inputs | None:
    inputs = [name for name, c in connectors.items() if c.causality is Causality.INPUT]
    problems = []
    columns: dict[str, Array] = {}
    for name, value in held.items():
        if name not in inputs:
            problems.append(f"--start-value {name}: is no input of numbers")
            continue
        try:
            columns[name] = np.asarray(_number(value, connectors[name]))[np.newaxis]
        except (TypeError, ValueError):
            unit = f" in {connectors[name].unit}" if connectors[name].unit != "1" else ""
            problems.append(f"--start-value {name}: {value!r} is no number{unit}")
    if problems:
        raise RunError("\n".join(problems))
    path, driven = Path("--start-value"), Results(np.zeros(1), columns, {})
    if table is not None:
        path, found = table, in_units_of(connectors, read_results(table), table)
        held_columns = {n: np.repeat(c, len(found.times), axis=0) for n, c in columns.items()}
        driven = Results(found.times, {**held_columns, **found.columns}, {})
    if not driven.columns:
        return None
    return Inputs(table_of_inputs(path, driven, connectors), driven)


def _number(value: Any, input_: Connector) -> Array:
    """One number or several, in the unit of an input; text says a unit of its own.

    Raises:
        TypeError, ValueError: it is none.
    """
    if isinstance(value, str):
        definition, is_relative = input_.definition, input_.is_relative
        value = float(number_in(value, input_.unit, definition, is_difference=is_relative))
    return np.asarray(value, np.float64)


def _is_named(connector: Connector) -> bool:
    """Whether an axis has a name in place of a length."""
    return any(isinstance(length, str) for length in connector.shape)


def _results(folder: Path, outputs: Sequence[str], connectors: Mapping[str, Connector]) -> Results:
    """What was recorded until the run ended, or failed."""
    try:
        recording = Recording(folder)
        series = {name: recording[f"{_FMU}.{name}"] for name in outputs}
    except CosimError:
        return Results(np.empty(0), {}, {})
    times = next(iter(series.values())).times * 1e-9
    columns = {
        name: np.stack(list(each)) if _is_named(connectors[name]) else np.asarray(each.values)
        for name, each in series.items()
    }
    # what is fixed was recorded once
    columns = {n: c if len(c) == len(times) else np.repeat(c, len(times), axis=0)
               for n, c in columns.items()}  # fmt: skip
    return Results(times, columns, {n: connectors[n].unit for n in outputs})
