"""Docstrings are sentences that stand alone; functions of arrays say of which shape these are.

What the rules of CONTRIBUTING.md mean to this test:

* A docstring, also one of a module or below a constant, begins with a capital letter, a digit, a
  quotation mark or code in backquotes, and neither with "The same" nor with a preposition: "Of the
  body [m]." begins in the middle of a sentence whose beginning is the name above. "From" may begin
  a title: "From a scan to a message."
* The docstring of a public function or method that takes or gives arrays (NumPy's or PyTorch's)
  names their shapes with this word: "shape (vehicle, 3)", "of the shape of `distance`", "any
  shape". Public is what has no leading underscore, nor its class or module; an `@override` has no
  docstring, because the declaration says it.

`UNSHAPED` and `UNFINISHED` are the modules that break the rules until somebody has been there.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Final, TypeAlias

import pytest

ROOT: Final = Path(__file__).parents[1]
PACKAGES: Final = ("orchestrator", "fmus", "adapters", "studies", "benchmarks")

ARRAY_TYPES: Final = frozenset({"ndarray", "NDArray", "Tensor"})
PREPOSITIONS: Final = (
    "Above|Along|As|At|Before|Below|Behind|Beside|Between|By|For|In|Into|Of|On|Over|Per|Than|Through|"
    "To|Under|With|Without"
)
SENTENCE: Final = re.compile(rf"(?!({PREPOSITIONS}|The same)\b)[A-Z0-9`\"]")
SHAPE: Final = re.compile(r"\bshapes?\b", re.IGNORECASE)

UNSHAPED: Final = frozenset(
    {
        "orchestrator/recording/samples.py",
        "fmus/driving/network/driver.py",
        "fmus/driving/network/encoder.py",
        "fmus/driving/network/fixed_point.py",
        "fmus/driving/network/fusion.py",
        "fmus/driving/network/plane.py",
        "fmus/driving/network/point_transformer.py",
        "fmus/driving/policy/conflict.py",
        "fmus/driving/policy/occupancy.py",
        "fmus/driving/policy/route.py",
        "fmus/relay/bystanders.py",
        "fmus/relay/crossings.py",
        "fmus/relay/expectation.py",
        "fmus/relay/knife_edges.py",
        "fmus/relay/measured.py",
        "fmus/relay/obstacles.py",
        "fmus/relay/prediction.py",
        "fmus/relay/radio.py",
        "adapters/fmi/block.py",
        "adapters/sumo/fleet.py",
        "adapters/sumo/geometry.py",
        "adapters/sumo/roadside.py",
        "adapters/sumo/scene.py",
        "studies/collision/curve.py",
        "studies/red_light/delivery.py",
        "studies/red_light/metrics.py",
        "studies/red_light/traces.py",
        "studies/training/learning/batches.py",
        "studies/training/learning/cloud_lessons.py",
        "studies/training/learning/cloud_model.py",
        "studies/training/learning/decision.py",
        "studies/training/learning/descent.py",
        "studies/training/learning/lessons.py",
        "studies/verification/channel/session.py",
        "studies/verification/channel/stack_matching.py",
        "studies/verification/channel/stack_pair_totals.py",
        "studies/verification/channel/stack_run.py",
        "studies/verification/channel/stack_spanning.py",
        "studies/verification/channel/table.py",
        "studies/verification/perception/bytes_on_air.py",
        "studies/verification/perception/road.py",
        "studies/verification/perception/session.py",
        "benchmarks/channel/layout.py",
        "benchmarks/channel/workload.py",
        "benchmarks/lidar/town.py",
    }
)
UNFINISHED: Final = frozenset(
    {
        "orchestrator/algorithm/outputs.py",
        "orchestrator/experiment/journal.py",
        "orchestrator/experiment/plan.py",
        "orchestrator/fork.py",
        "orchestrator/intervals.py",
        "orchestrator/observer.py",
        "orchestrator/provenance.py",
        "orchestrator/recording/layout.py",
        "orchestrator/scenario/schema.py",
        "orchestrator/scenario/settings_file.py",
        "orchestrator/scenario/unit_table.py",
        "orchestrator/signal.py",
        "fmus/driving/network/architecture.py",
        "fmus/driving/network/cloud.py",
        "fmus/driving/network/encoder.py",
        "fmus/driving/network/fixed_point.py",
        "fmus/driving/network/fusion.py",
        "fmus/driving/network/patches.py",
        "fmus/driving/network/plane.py",
        "fmus/driving/network/point_transformer.py",
        "fmus/driving/network/point_transformer_shapes.py",
        "fmus/driving/network/scan.py",
        "fmus/driving/network/sensors.py",
        "fmus/driving/point_transformer/encoder.py",
        "fmus/driving/point_transformer/neighbours.py",
        "fmus/driving/policy/expert.py",
        "fmus/driving/policy/occupancy.py",
        "fmus/driving/policy/steering.py",
        "fmus/native/archive.py",
        "fmus/native/c_table.py",
        "fmus/native/check.py",
        "fmus/native/model_description.py",
        "fmus/relay/knife_edges.py",
        "fmus/relay/nodes.py",
        "fmus/relay/obstacles.py",
        "fmus/relay/oracle.py",
        "fmus/relay/radio.py",
        "adapters/fmi/sizes.py",
        "adapters/sumo/cast.py",
        "adapters/sumo/collision_driver.py",
        "adapters/sumo/ego.py",
        "adapters/sumo/ego_driver.py",
        "adapters/sumo/fleet.py",
        "adapters/sumo/geometry.py",
        "adapters/sumo/parameters.py",
        "adapters/sumo/polyline.py",
        "adapters/sumo/road.py",
        "adapters/sumo/scene.py",
        "adapters/sumo/simulation.py",
        "adapters/sumo/traffic.py",
        "studies/collision/assumption.py",
        "studies/collision/campaign.py",
        "studies/collision/claims.py",
        "studies/collision/completion.py",
        "studies/collision/condition.py",
        "studies/collision/curve.py",
        "studies/collision/curves.py",
        "studies/collision/figure_per.py",
        "studies/collision/names.py",
        "studies/collision/page.py",
        "studies/collision/page_tables.py",
        "studies/collision/partners.py",
        "studies/collision/published.py",
        "studies/method/origin.py",
        "studies/method/page.py",
        "studies/method/style.py",
        "studies/method/verdict.py",
        "studies/red_light/sharing_cost.py",
        "studies/relay/figure7.py",
        "studies/relay/figure8.py",
        "studies/relay/paper.py",
        "studies/relay/provenance.py",
        "studies/relay/sample.py",
        "studies/relay/table2.py",
        "studies/training/figure.py",
        "studies/training/learning/batches.py",
        "studies/training/learning/bev.py",
        "studies/training/learning/cloud_lessons.py",
        "studies/training/learning/decision.py",
        "studies/training/learning/imitation.py",
        "studies/training/learning/lessons.py",
        "studies/training/learning/point_transformer.py",
        "studies/training/learning/sample.py",
        "studies/training/results.py",
        "studies/training/rollouts.py",
        "studies/training/schema.py",
        "studies/training/train.py",
        "studies/verification/channel/check.py",
        "studies/verification/channel/knife_edge_profiles.py",
        "studies/verification/channel/min_snir.py",
        "studies/verification/channel/page.py",
        "studies/verification/channel/scene.py",
        "studies/verification/channel/stack_medium_access.py",
        "studies/verification/channel/stack_spanning.py",
        "studies/verification/channel/verification.py",
        "studies/verification/perception/bodies.py",
        "studies/verification/perception/bytes_on_air.py",
        "studies/verification/perception/demanded.py",
        "studies/verification/perception/figures.py",
        "studies/verification/perception/generator.py",
        "studies/verification/perception/method.py",
        "studies/verification/perception/parameter_set.py",
        "studies/verification/perception/prose.py",
        "studies/verification/perception/resolution.py",
        "studies/verification/perception/road.py",
        "studies/verification/perception/scene.py",
        "studies/verification/perception/sight.py",
        "studies/verification/perception/tables.py",
        "studies/verification/perception/traffic.py",
        "studies/verification/perception/truth.py",
        "studies/verification/perception/verification.py",
        "benchmarks/channel/beacons.py",
        "benchmarks/channel/benchmark.py",
        "benchmarks/channel/case.py",
        "benchmarks/channel/workload.py",
        "benchmarks/lidar/caster.py",
        "benchmarks/lidar/embree.py",
        "benchmarks/lidar/pattern.py",
        "benchmarks/lidar/town.py",
        "benchmarks/machine.py",
        "benchmarks/policy/benchmark.py",
        "benchmarks/policy/scans.py",
        "benchmarks/policy/transformer.py",
        "benchmarks/spread.py",
    }
)

Function: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def modules(package: str) -> dict[str, ast.Module]:
    """The parsed modules of a package, by their paths in the repository."""
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted((ROOT / package).rglob("*.py"))
    }


def words(expression: ast.expr | None) -> set[str]:
    """The names in a type, also in a quoted one."""
    return set(re.findall(r"\w+", ast.unparse(expression))) if expression else set()


@cache
def array_types() -> frozenset[str]:
    """The names of arrays in annotations: those of the libraries, and ours for them."""
    named: set[str] = set()
    for package in PACKAGES:
        for module in modules(package).values():
            for line in module.body:
                match line:
                    case ast.Assign(targets=[ast.Name(id=name)], value=value):
                        pass
                    case ast.AnnAssign(target=ast.Name(id=name), value=value):
                        pass
                    case _:
                        continue
                if not isinstance(value, ast.Call) and words(value) & ARRAY_TYPES:
                    named.add(name)
    return ARRAY_TYPES | named


def public_functions(body: Iterable[ast.stmt]) -> Iterator[Function]:
    """The public functions and methods of a module or a class; no overrides."""
    for line in body:
        match line:
            case ast.ClassDef(name=name, body=members) if not name.startswith("_"):
                yield from public_functions(members)
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                decorators = set[str]().union(*map(words, line.decorator_list))
                if not line.name.startswith("_") and "override" not in decorators:
                    yield line


def has_arrays(function: Function) -> bool:
    """Whether arrays go in or come out."""
    given = function.args
    arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    annotations = [*(argument.annotation for argument in arguments), function.returns]
    return any(words(annotation) & array_types() for annotation in annotations)


def without_shapes(path: str, module: ast.Module) -> list[str]:
    """The functions whose docstrings leave the shapes of arrays open."""
    if Path(path).name.removesuffix("__init__.py").startswith("_"):
        return []
    return [
        f"{path}:{function.lineno} {function.name}"
        for function in public_functions(module.body)
        if has_arrays(function) and not SHAPE.search(ast.get_docstring(function) or "")
    ]


def fragments(path: str, module: ast.Module) -> list[str]:
    """The docstrings that do not begin as sentences."""
    found = []
    for node in ast.walk(module):
        if not isinstance(node, ast.Module | ast.ClassDef | Function):
            continue
        for line in node.body:
            match line:
                case ast.Expr(value=ast.Constant(value=str() as text)) if not SENTENCE.match(text):
                    found.append(f"{path}:{line.lineno} {text.splitlines()[0]}")
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_functions_of_arrays_say_of_which_shape(package: str) -> None:
    found = [
        line
        for path, module in modules(package).items()
        if path not in UNSHAPED
        for line in without_shapes(path, module)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_begin_as_sentences(package: str) -> None:
    found = [
        line
        for path, module in modules(package).items()
        if path not in UNFINISHED
        for line in fragments(path, module)
    ]
    assert not found, "\n".join(found)


def test_the_rules_see_what_they_are_for() -> None:
    """The examples of this module's docstring."""
    assert not SENTENCE.match("Of the body [m].")
    assert not SENTENCE.match("The same for sizes and heights [m].")
    assert not SENTENCE.match("[m/s].")
    assert SENTENCE.match("Offsets of the body from the lane [m], shape (vehicle,).")
    assert SENTENCE.match("`values[index]`, several times faster on a CPU.")
    assert {"Array", "Float", "Tensor"} <= array_types()
