"""`palpate textures simulate` on a simulator that makes nothing: options, messages, exit codes."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from click.testing import CliRunner

from palpate.modeling.commands_texture_set import simulate
from palpate.modeling.commands_textures import evaluate_textures
from palpate.modeling.textures.recording import TextureDataError


@dataclass
class Session:
    study: str
    participant: str
    done: str = "made"
    complete: bool = True
    events: int = 7
    ended: str = "complete"
    ledger: Path = Path("a.sqlite")


@dataclass
class Front:
    sessions: list
    options: dict = field(default_factory=dict)

    def __call__(self):
        return self

    def make_set(self, lab, report, **options):
        report("50 textures")
        self.options = {"lab": lab, **options}
        return self.sessions


def test_the_request_reaches_the_simulator_and_its_counts_the_user(tmp_path):
    front = Front([Session("texture_capture", "P001", "kept"), Session("texture_ratings", "P001"),
                   Session("texture_ratings", "P002", "gone on")])  # fmt: skip
    result = CliRunner().invoke(
        simulate, ["--lab", str(tmp_path), "--textures", "T01, T02", "--textures", "T03", "--seed", "4"], obj=front
    )
    assert result.exit_code == 0, result.output
    assert front.options == {
        "lab": tmp_path, "textures": ("T01", "T02", "T03"), "seconds": None, "pictures": None, "raters": None,
        "seed": 4, "workers": 1, "quick": False,
    }  # fmt: skip
    assert "texture_capture: 1 session complete (1 kept)" in result.output
    assert "texture_ratings: 2 sessions complete (1 made, 1 gone on)" in result.output
    assert "no measurement" in result.output and "50 textures" in result.stderr


def test_a_complete_set_is_reported_as_unchanged(tmp_path):
    for done, unchanged in (("kept", True), ("made", False)):
        front = Front([Session("texture_capture", "P001", "kept"), Session("texture_ratings", "P001", done)])
        result = CliRunner().invoke(simulate, ["--lab", str(tmp_path)], obj=front)
        assert ("Everything exists already: nothing was changed" in result.stdout) is unchanged
        assert f"palpate textures index --lab {tmp_path}" in result.stdout


def test_stopped_it_says_how_to_go_on_and_fails(tmp_path):
    front = Front([Session("texture_capture", "P001", complete=False, ended="interrupted by SIGINT")])
    result = CliRunner().invoke(simulate, ["--lab", str(tmp_path)], obj=front)
    assert result.exit_code == 130
    assert (
        "texture_capture: interrupted by SIGINT. Finished parts are saved: run the same command again" in result.stderr
    )


def test_as_json(tmp_path):
    result = CliRunner().invoke(simulate, ["--lab", str(tmp_path), "--json"], obj=Front([Session("a", "P001")]))
    assert json.loads(result.stdout)[0]["participant"] == "P001"


@pytest.mark.needs("torch")
@pytest.mark.parametrize(("option", "words"), [("--hatt", "no XML file"), ("--cluster-data", "sensor_data/accel")])
def test_foreign_data_can_be_trained_on(tmp_path, option, words):
    with pytest.raises(TextureDataError, match=words):
        CliRunner().invoke(evaluate_textures, [option, str(tmp_path)], obj=lambda: None, catch_exceptions=False)
    result = CliRunner().invoke(evaluate_textures, [option, str(tmp_path), "--simulated"], obj=lambda: None)
    assert result.exit_code == 2 and "one of them is expected" in result.output
