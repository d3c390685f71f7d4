"""The package is one way: a module imports only from those before it; only the cli prints."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import liggghts_driver

PACKAGE = Path(liggghts_driver.__file__).parent
ORDER = [
    "errors", "resources", "machine", "physics", "packing", "darcy", "statistics", "scene",
    "accuracy", "population", "prediction", "flowing", "drag_plan", "contacts", "speeds", "loads",
    "bounds", "timestep", "case", "effects", "prepare", "deck", "identity", "outputs", "rundir",
    "batch", "claim", "results", "written", "engine", "watch", "attempt", "run", "report",
    "explain", "solve", "sweeps", "studies", "paper", "cli",
]  # fmt: skip
#: Imports for annotations alone that go back: the class of a finished run.
KNOWN = {("results", "run")}
MODULES = sorted(PACKAGE.rglob("*.py"))


def part_of(path: Path) -> str:
    """The part of the package that a file belongs to: a module or a folder of it."""
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def imported_parts(path: Path) -> set[str]:
    """The parts of the package that a file imports from, in functions and for types too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("liggghts_driver"):
            assert node.level == 0
            below = node.module.split(".")[1:]
            found |= {below[0]} if below else {alias.name for alias in node.names}
        if isinstance(node, ast.Import):
            found |= {
                alias.name.split(".")[1]
                for alias in node.names
                if alias.name.startswith("liggghts_driver.")
            }
    return {name for name in found if not name.startswith("__")} - {part_of(path)}


def test_every_part_has_its_place_in_the_order():
    parts = {part_of(path) for path in MODULES} - {"__init__", "__main__"}
    assert parts == set(ORDER)


@pytest.mark.parametrize("part", ORDER)
def test_a_part_imports_only_from_those_before_it(part):
    before = set(ORDER[: ORDER.index(part)])
    wrong = {
        (str(path.relative_to(PACKAGE)), other)
        for path in MODULES
        if part_of(path) == part
        for other in imported_parts(path) - before
        if (part, other) not in KNOWN
    }
    assert not wrong


def test_the_estimate_knows_nothing_of_decks_and_results():
    """The comparison is independent: what it compares shares no code beyond the scene."""
    for part in ("darcy", "prediction"):
        for path in MODULES:
            if part_of(path) == part:
                allowed = {"errors", "scene", "darcy"}
                assert imported_parts(path) <= allowed


def prints_or_exits(path: Path) -> list[str]:
    """Calls that print or exit, and the modules that do it for others."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            if name in {"print", "exit", "quit", "sys.exit", "os._exit", "os.abort", "input"}:
                found.append(f"{path.name}:{node.lineno} {name}")
        if isinstance(node, ast.Attribute) and ast.unparse(node) in {"sys.stdout", "sys.stderr"}:
            found.append(f"{path.name}:{node.lineno} {ast.unparse(node)}")
        if isinstance(node, ast.Name) and node.id == "SystemExit":
            found.append(f"{path.name}:{node.lineno} SystemExit")
        modules = [node.module] if isinstance(node, ast.ImportFrom) else []
        modules += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        found += [
            f"{path.name} {name}" for name in modules if (name or "").split(".")[0] in TERMINAL
        ]
    return found


TERMINAL = {"rich", "typer", "click", "logging", "warnings", "argparse"}


def test_only_the_command_line_prints_or_exits():
    elsewhere = [path for path in MODULES if part_of(path) != "cli"]
    assert not [fault for path in elsewhere for fault in prints_or_exits(path)]
    assert [fault for path in MODULES for fault in prints_or_exits(path)]  # the cli does


def test_no_file_is_long():
    """One idea each: about 250 lines, a little more where a docstring is long."""
    lengths = {
        path.relative_to(PACKAGE): len(path.read_text(encoding="utf-8").splitlines())
        for path in MODULES
    }
    assert max(lengths.values()) <= 320, max(lengths, key=lengths.get)
