"""Which optional extra installs a missing package, and the error message for it."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

EXTRAS = {
    "psychopy": "lab", "flask": "monitor", "waitress": "monitor", "serial": "rig", "nidaqmx": "rig", "pylsl": "rig",
    "sounddevice": "rig", "torch": "models", "joblib": "models", "sklearn": "models", "librosa": "models",
    "pywt": "models", "skimage": "models", "distributed": "cluster", "pyarrow": "export",
    "psycopg": "postgres",
}  # fmt: skip
"""The extra that installs each package, by the name it is imported by."""
MODELS = ("torch", "joblib", "sklearn")
FEATURES = ("librosa", "pywt", "skimage")


class ExtraMissing(ValueError):
    """An error for a missing package that only an extra installs."""


def demand_packages(what: str, *packages: str, hint: str = "") -> None:
    """Raise ExtraMissing, with the command to install them, unless all packages are installed."""
    if missing := [name for name in packages if not _is_there(name)]:
        raise ExtraMissing(missing_sentence(what, missing, hint))


@cache
def installed_version(package: str) -> str | None:
    """Return the version of an installed package, by the name that pip knows, without importing it.

    Looked up once per process: it reads the package's metadata.
    """
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _is_there(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def missing_sentence(what: str, missing: list[str], hint: str = "") -> str:
    """Return the message that says what needs which packages, and the command to install them."""
    names = f"{', '.join(missing[:-1])} and {missing[-1]}" if len(missing) > 1 else missing[0]
    extras = ",".join(dict.fromkeys(EXTRAS[name] for name in missing))
    there = "which are not installed" if len(missing) > 1 else "which is not installed"
    return f"{what} needs {names}, {there}: pip install 'palpate[{extras}]'" + (f" ({hint})" if hint else "")
