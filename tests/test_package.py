"""The package as it is imported and installed: quick, complete, from anywhere."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import time
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

import liggghts_driver

ROOT = Path(liggghts_driver.__file__).parent.parent
HEAVY = ["numpy", "pandas", "scipy", "matplotlib", "pydantic", "jinja2", "typer", "rich", "PIL"]


def python(code: str, folder: Path | None = None) -> str:
    """What a fresh interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_it_loads_nothing_heavy():
    code = f"import sys, liggghts_driver; print([m for m in {HEAVY} if m in sys.modules])"
    assert python(code).strip() == "[]"


def test_importing_it_is_quick():
    """A tenth of the half second that pandas alone would take, and that generously."""
    code = (
        "import time; start = time.perf_counter(); import liggghts_driver; "
        "print(time.perf_counter() - start)"
    )
    assert min(float(python(code)) for _ in range(3)) < 0.05


def test_the_estimate_needs_no_table_engine_or_pictures():
    code = (
        "import sys; from liggghts_driver import cases_dir, predict, read_scene; "
        "predict(read_scene(cases_dir() / 'infiltration.toml')); "
        "print([m for m in ['pandas', 'matplotlib', 'jinja2', 'PIL'] if m in sys.modules])"
    )
    assert python(code).strip() == "[]"


def test_public_names():
    for name in liggghts_driver.__all__:
        assert getattr(liggghts_driver, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        liggghts_driver.nonsense  # noqa: B018
    code = "from liggghts_driver import *; print(sorted(n for n in dir() if n[0] != '_'))"
    public = [name for name in liggghts_driver.__all__ if not name.startswith("_")]
    assert python(code).strip() == str(sorted(public))


#: Distributions whose modules have another name.
MODULE_NAMES = {"pillow": "PIL"}


def test_what_is_imported_is_declared():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    names = [re.split(r"[<>=~ ;\[]", requirement)[0] for requirement in declared]
    known = {MODULE_NAMES.get(name.lower(), name) for name in names}
    used = set()
    for path in (ROOT / "liggghts_driver").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [node.module] if isinstance(node, ast.ImportFrom) else []
            modules += [a.name for a in node.names] if isinstance(node, ast.Import) else []
            used |= {module.split(".")[0] for module in modules if module}
    foreign = used - set(sys.stdlib_module_names) - {"liggghts_driver"}
    # pydantic_core is a part of pydantic, published with it.
    assert foreign - {"pydantic_core"} == known


def build_wheel(folder: Path) -> Path:
    """The wheel of this checkout, built without a network."""
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
    done = subprocess.run(
        [*command, "--wheel-dir", str(folder), str(ROOT)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    if not (ROOT / "pyproject.toml").exists():
        pytest.skip("installed without its sources")
    return build_wheel(tmp_path_factory.mktemp("wheel"))


def test_a_wheel_holds_code_templates_and_cases_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    inside = {name for name in names if name.startswith("liggghts_driver/")}
    for folder, pattern in [("templates", "*.j2"), ("cases", "*.toml")]:
        expected = {
            f"liggghts_driver/{path.relative_to(ROOT)}" for path in (ROOT / folder).rglob(pattern)
        }
        assert expected
        assert expected <= inside
    studies = {path.relative_to(ROOT) for path in (ROOT / "cases" / "accuracy").glob("*.json")}
    assert {f"liggghts_driver/{path}" for path in studies} <= inside
    assert "liggghts_driver/py.typed" in inside
    others = {name for name in names if name not in inside and ".dist-info/" not in name}
    assert not others
    assert not [name for name in names if "__pycache__" in name or name.startswith("tests")]


def test_an_installed_wheel_works_from_another_folder(wheel, tmp_path):
    """Installed into a fresh environment, which borrows only what it depends on."""
    home = tmp_path / "fresh"
    venv.create(home, with_pip=False)
    (site,) = home.glob("lib/python*/site-packages")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*install, "--target", str(site), str(wheel)], check=True, capture_output=True)
    dependencies = next(path for path in map(Path, sys.path) if (path / "numpy").is_dir())
    # After the fresh folder, and without the .pth file that names the checkout.
    fresh = str(home / "bin" / "python")
    environment = {**os.environ, "PYTHONPATH": f"{site}:{dependencies}"}
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [fresh, *arguments],
            cwd=elsewhere,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    where = run("-c", "import liggghts_driver as d; print(d.__file__, d.cases_dir())").split()
    assert all(path.startswith(str(site)) for path in where)
    cases = Path(where[1])
    command = ["-m", "liggghts_driver", "estimate", str(cases / "infiltration.toml"), "--json"]
    answer = json.loads(run(*command))
    # physics.md: 1.86e-6 m3/s, three digits.
    assert answer["particle_flow_rate_m3_s"] == pytest.approx(1.86e-6, rel=3e-3)
    deck = ["-m", "liggghts_driver", "deck", str(cases / "two_spheres.toml"), "--out", "made"]
    assert "made/deck.in" in run(*deck)
    assert (elsewhere / "made" / "deck.in").read_text().startswith("# Head-on collision")


@pytest.mark.validate
def test_a_wheel_with_everything_it_depends_on(wheel, tmp_path):
    """The same with nothing borrowed: needs a package index, and a minute."""
    home = tmp_path / "fresh"
    venv.create(home, with_pip=True)
    install = [str(home / "bin" / "python"), "-m", "pip", "install", "--quiet", str(wheel)]
    done = subprocess.run(install, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip("no package index can be reached")
    start = time.monotonic()
    done = subprocess.run(
        [str(home / "bin" / "liggghts-driver"), "--version"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f"{liggghts_driver.__version__}\n"
    assert time.monotonic() - start < 30
