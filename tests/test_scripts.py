"""Scripts beside the package, which tests do not run, import what it has."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCRIPTS = [file for folder in ("benchmarks", "docs") for file in sorted((ROOT / folder).rglob("*.py"))]


def test_every_script_imports_what_the_package_has() -> None:
    missing = [f"{script.relative_to(ROOT)}: {name}" for script in SCRIPTS for name in taken(script) if not there(name)]
    assert len(SCRIPTS) > 20 and not missing


def taken(script: Path) -> list[str]:
    """Dotted names that a script imports from the package, wherever in it."""
    imports = [each for each in ast.walk(ast.parse(script.read_text())) if isinstance(each, ast.ImportFrom)]
    own = [each for each in imports if (each.module or "").split(".")[0] == "wristctl"]
    return [f"{each.module}.{alias.name}" for each in own for alias in each.names]


def there(name: str) -> bool:
    """Whether a module has the name, or is one itself."""
    module, _, attribute = name.rpartition(".")
    try:
        return hasattr(import_module(module), attribute) or bool(import_module(name))
    except ModuleNotFoundError:
        return False


def test_peers_read_the_wrists_equations_without_numba() -> None:
    peers = ROOT / "benchmarks" / "peers"
    program = (
        f"import sys; sys.modules['numba'] = None; sys.path.insert(0, {str(peers)!r}); import equations, chain, task"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT)
