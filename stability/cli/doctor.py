"""``stability doctor``: is the right package imported, with which versions, back ends and caches.

Another distribution on PyPI is called ``stability`` and installs a package of the same name; whichever is installed
last overwrites the files of the other. The doctor compares what is on disk with what the distribution
``stability-bifurcation`` recorded when it was installed.
"""

from __future__ import annotations

import base64
import hashlib
import importlib.metadata as metadata
import os
import platform
import sys
import time
from pathlib import Path
from typing import Any

import click

from .._version import __version__
from ._console import FAILURE, OK, Console, as_json_option

DISTRIBUTION = "stability-bifurcation"
REQUIRED = ("numpy", "scipy", "sympy", "matplotlib", "numba", "llvmlite", "click", "rich")
OPTIONAL = ("xarray", "heyoka", "mpmath")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@click.command("doctor")
@as_json_option
@click.pass_obj
def command(console: Console) -> int:
    """Say which 'stability' is imported; check versions, back ends and caches. Exit code 1 if something is wrong."""
    with console.working("examining"):
        package, required, optional = _package(), _versions(REQUIRED), _versions(OPTIONAL)
        ends, caches = _back_ends(), _caches()
    troubles = [*package.pop("troubles"), *(f"{name} is not installed" for name, v in required.items() if v is None)]
    troubles += [f"back end {name}: {end['trouble']}" for name, end in ends.items() if "trouble" in end]
    troubles += [f"cache folder {c['path']} cannot be written: every session compiles anew"
                 for c in caches.values() if not c["writable"]]
    document = {
        "package": package,
        "python": {"version": platform.python_version(), "executable": sys.executable, "platform": platform.platform()},
        "versions": required,
        "optional": optional,
        "back_ends": ends,
        "caches": caches,
        "threads": {"cores": os.cpu_count(), **{name: os.environ.get(name) for name in THREADS}},
        "troubles": troubles,
    }
    _report(console, document)
    console.result(document)
    return FAILURE if troubles else OK


def _report(console: Console, document: dict[str, Any]) -> None:
    package, python = document["package"], document["python"]
    console.say(f"stability {package['version']}", bold=True)
    console.table([
        ("package", package["path"]),
        ("distribution", f"{DISTRIBUTION} {package['distribution'] or 'not installed: imported from that folder'}"),
        ("python", f"{python['version']}, {python['executable']}"),
        ("platform", python["platform"]),
        ("cores", str(document["threads"]["cores"])),
    ])
    console.say("versions", bold=True)
    console.table([
        *((name, version or "MISSING") for name, version in document["versions"].items()),
        *((name, version or "not installed (optional)") for name, version in document["optional"].items()),
    ])
    console.say("back ends", bold=True)
    console.table([(name, end.get("trouble") or f"works, {1e3 * end['seconds']:.0f} ms to build and evaluate one model")
                   for name, end in document["back_ends"].items()])
    console.say("caches", bold=True)
    console.table([(name, f"{cache['path']}: {cache['files']} files, {cache['bytes'] / 1e6:.1f} MB"
                    + ("" if cache["writable"] else ", NOT WRITABLE")) for name, cache in document["caches"].items()])
    console.say()
    for trouble in document["troubles"]:
        console.say(f"trouble: {trouble}", fg="red")
    if not document["troubles"]:
        console.say("all is well", fg="green")


def _package() -> dict[str, Any]:
    import stability

    path = Path(stability.__file__ or "")
    troubles = []
    version = getattr(stability, "__version__", None)
    if version != __version__ or not hasattr(stability, "_EXPORTS"):
        troubles.append(f"`import stability` finds another package, {path}; {_cure()}")
    claimants = sorted(set(metadata.packages_distributions().get("stability", [])) - {DISTRIBUTION})
    if claimants:
        troubles.append(f"{', '.join(claimants)} also installs a package named stability; {_cure()}")
    try:
        distribution: str | None = metadata.version(DISTRIBUTION)
        troubles += [f"{name} is not the file that was installed; {_cure()}" for name in _altered()]
    except metadata.PackageNotFoundError:
        distribution = None
    return {"version": version, "path": str(path.parent), "distribution": distribution, "troubles": troubles}


def _cure() -> str:
    return f"uninstall the other one (pip uninstall stability) and install {DISTRIBUTION} again"


def _altered() -> list[str]:
    """Files of the package whose content differs from the installation record."""
    changed = []
    for file in metadata.files(DISTRIBUTION) or []:
        if file.hash is None or file.parts[0] != "stability":
            continue
        found = Path(str(file.locate()))
        if not found.is_file():
            changed.append(str(file))
            continue
        digest = hashlib.new(file.hash.mode, found.read_bytes()).digest()
        if base64.urlsafe_b64encode(digest).rstrip(b"=").decode() != file.hash.value:
            changed.append(str(file))
    return changed


def _versions(names: tuple[str, ...]) -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = None
    return found


def _back_ends() -> dict[str, dict[str, Any]]:
    """Build x'' + x = 0 with each back end and compare the value with the closed form."""
    import sympy as sp

    t = sp.Symbol("t", real=True)

    def measure(name: str) -> dict[str, Any]:
        start = time.perf_counter()
        try:
            values = _oscillator_values(name, sp.Function("x")(t), t)
        except (ImportError, RuntimeError, NotImplementedError, OSError, ValueError) as error:
            return {"trouble": f"{type(error).__name__}: {error}"}
        if values != [[2.0, -1.0], [4.0, -3.0]]:
            return {"trouble": f"a wrong value: {values}"}
        return {"seconds": time.perf_counter() - start}

    return {name: measure(name) for name in ("lambdify", "llvm")}


def _oscillator_values(backend: str, x: Any, t: Any) -> list[list[float]]:
    """dx/dt of x'' + x = 0 at (1, 2) and (3, 4), by the back end of this name."""
    import numpy as np

    from ..systems.evaluators import evaluator
    from ..systems.system import System

    oscillator = System.from_equations({x.diff(t, 2): -x}, coordinates=[x], parameters={})
    states = np.array([[1.0, 2.0], [3.0, 4.0]])
    values: list[list[float]] = evaluator(oscillator, backend=backend).F(np.zeros(2), states, np.zeros(0)).tolist()
    return values


def _caches() -> dict[str, dict[str, Any]]:
    """Where numba keeps the compiled kernels."""
    import stability

    folder = os.environ.get("NUMBA_CACHE_DIR")
    path = Path(folder) if folder else Path(stability.__file__ or ".").parent
    files = list(path.rglob("*.nb[ci]")) if path.is_dir() else []
    existing = next(p for p in (path, *path.parents) if p.exists())
    return {
        "numba kernels": {
            "path": str(path),
            "files": len(files),
            "bytes": sum(f.stat().st_size for f in files),
            "writable": os.access(existing, os.W_OK),
        }
    }
