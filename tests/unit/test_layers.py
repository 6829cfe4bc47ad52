"""Who may import whom, as an ordered list: a module imports only from lower layers."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

APP = Path(__file__).parents[2] / "app"
LAYERS = [
    {"errors"},
    {"options", "util"},
    {"scene", "gpu"},
    {"atlas"},
    {"lightmap"},
    {"visibility"},
    {"reference", "direct_light"},
    {"solvers", "bake"},
    {"estimate", "compare"},
    {"render"},
    {"session"},
    {"ui"},
    {"viewer"},
    {"commands", "validation"},
    {"bench"},
    {"cli"},
    {"__main__"},
]
LAYER = {name: i for i, layer in enumerate(LAYERS) for name in layer}
# packages of GL may be imported only here
GL = {"gpu", "viewer"}
READERS = (
    "render",
    "bake",
    "estimate",
    "compare",
)  # of what solvers write: they know neither how nor by what it was written
FORBIDDEN = {
    ("scene", "gpu"),
    ("gpu", "scene"),
    *((reader, "solvers") for reader in READERS),
    ("solvers", "reference"),
    ("ui", "gpu"),
}
FAMILIES = {path.parent.name for path in APP.glob("solvers/*/__init__.py")}
BY_PARTS = {
    "bench",
    "validation",
}  # takes the shots of one family apart; all others know solvers by their table and protocol
FILES = sorted(APP.rglob("*.py"))


def outside_of_its_family(path: Path, name: str) -> bool:
    """Whether ``app.solvers.FAMILY...`` is imported by another family or from outside of the table of solvers."""
    family = (*name.split("."), "", "")[2] if name.startswith("app.solvers.") else ""
    place = path.relative_to(APP).parts
    at_home = place[:2] in (("solvers", family), ("solvers", "__init__.py")) or place[0] in BY_PARTS
    return family in FAMILIES and not at_home


def imported(path: Path) -> set[str]:
    """All that a file imports, also what only a type checker sees: a circle of types is a circle."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def module_of(path: Path) -> str:
    return ".".join(("app", *path.relative_to(APP).with_suffix("").parts)).removesuffix(".__init__")


def test_no_circle_of_imports() -> None:
    """Modules that import each other, however far around."""
    modules = {module_of(path): path for path in FILES}
    graph = {name: {other for other in imported(path) if other in modules} - {name} for name, path in modules.items()}
    for name in graph:  # a package's own __init__ gathers what is inside it
        graph[name] = {o for o in graph[name] if not name.startswith(o + ".") and not o == "app"}
    order = TopologicalSorter(graph)
    order.prepare()  # raises CycleError, which names the circle


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(APP)))
def test_imports_only_from_lower_layers(path: Path) -> None:
    own = path.relative_to(APP).with_suffix("").parts[0]
    if own == "__init__":
        return
    assert own in LAYER, f"app/{own} has no layer: give it one here"
    for name in imported(path):
        top, *rest = name.split(".")
        assert not outside_of_its_family(path, name), f"{path} imports {name}: only app.solvers is for all"
        if top in ("moderngl", "moderngl_window"):
            assert own in GL, f"{path}: {top} is imported only in {', '.join(sorted(GL))}"
        if top != "app" or not rest or rest[0] == own:
            continue
        assert (own, rest[0]) not in FORBIDDEN, f"{path} imports app.{rest[0]}"
        if rest[0] in LAYER:
            assert LAYER[rest[0]] < LAYER[own], f"{path}: {own} may not import app.{rest[0]}"


def uses_of_a_solver(path: Path) -> set[str]:
    """Names that a file asks of something called ``solver``."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Attribute):
            owner = node.value
            name = owner.attr if isinstance(owner, ast.Attribute) else owner.id if isinstance(owner, ast.Name) else ""
            found |= {node.attr} if name == "solver" else set()
    return found


@pytest.mark.parametrize("path", [p for p in FILES if p.relative_to(APP).parts[0] not in ("solvers", "ui")], ids=str)
def test_the_protocol_names_all_that_is_asked_of_a_solver(path: Path) -> None:
    from app.solvers import Solver

    named = {n for n in (*vars(Solver), *Solver.__annotations__) if not n.startswith("_")}
    assert uses_of_a_solver(path) <= named


def test_files_at_the_root_are_the_four() -> None:
    assert {path.stem for path in APP.glob("*.py")} == {"__init__", "__main__", "cli", "errors", "options"}


def test_every_solver_has_what_the_protocol_names() -> None:
    from app.options import specs
    from app.solvers import DEFAULT_SOLVER, SOLVERS, Solver

    assert DEFAULT_SOLVER in SOLVERS
    methods = {name for name, value in vars(Solver).items() if callable(value) and not name.startswith("_")}
    assert methods >= {"reset", "set_options", "work", "poll", "settle", "energy", "passes", "inspect", "release"}
    for family in SOLVERS.values():
        assert methods <= set(dir(family.make))
        assert family.threshold in {spec.name for spec in specs(family.options)}
