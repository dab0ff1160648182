"""The room's public calls: each is where the documentation has it, and importing the room imports nothing heavy."""

import subprocess
import sys
from pathlib import Path

import pytest

from palpate import analysis

HERE = Path(analysis.__file__).parent


@pytest.mark.parametrize("name", analysis.__all__)
def test_every_public_name_can_be_had_and_is_hidden_by_no_module(name):
    assert getattr(analysis, name).__name__ == name
    assert not (HERE / name).is_dir() and not (HERE / f"{name}.py").is_file()


def test_a_name_that_is_not_there_is_refused():
    with pytest.raises(AttributeError, match="no attribute 'rm_anowa'"):
        _ = analysis.rm_anowa


def test_importing_the_room_imports_nothing_heavy():
    code = "import palpate.analysis, sys; print(sorted({'numpy', 'pandas', 'scipy', 'matplotlib'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
