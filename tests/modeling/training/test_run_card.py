"""What a run card says of the software: versions without an import."""

import subprocess
import sys
from importlib.metadata import version

import pytest

from palpate.modeling.training import run_card
from palpate.modeling.training.run_card import BESIDE, PACKAGES, versions


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_every_package_that_makes_features_is_named_with_its_installed_version():
    named = versions()
    assert set(PACKAGES) < set(named)
    for name in ("librosa", "scikit-image", "pywavelets", "pillow"):
        assert named[name] == version(name)


def test_what_is_not_installed_is_null_or_where_it_only_stands_beside_not_named(monkeypatch):
    monkeypatch.setattr(run_card, "installed_version", lambda name: None if name in ("torch", "librosa") else "1")
    named = versions()
    assert named["torch"] is None
    assert set(named) == {"python", *PACKAGES, *BESIDE} - {"librosa"}


def test_no_package_is_imported_for_its_version():
    code = (
        "import sys; from palpate.modeling.training.run_card import versions; versions(); "
        "sys.exit(bool({'numpy', 'scipy', 'torch', 'sklearn', 'librosa', 'skimage', 'pywt', 'PIL'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
