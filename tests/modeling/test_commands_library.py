"""`palpate textures`: requests on the command line, and their answers."""

import io
import json
import subprocess
import sys

import pytest
from PIL import Image

from palpate import command_line
from palpate.modeling.commands_library import textures
from palpate.modeling.library.files import place_of, write_library
from palpate.modeling.library.lab import save_thumbnail
from tests.commands_for_tests import run_command, run_verb
from tests.modeling.library.library_for_tests import small_library

HEAVY = "torch pandas sqlalchemy sklearn scipy librosa"


def picture(colour):
    content = io.BytesIO()
    Image.new("RGB", (30, 30), colour).save(content, "PNG")
    return content.getvalue()


@pytest.fixture
def lab(tmp_path):
    """A lab with a library; T01 has a picture."""
    library = small_library(simulated=True)
    name = save_thumbnail(place_of(tmp_path).parent, "T01", picture((200, 30, 40)), "x")
    first = library.textures[0].model_copy(update={"picture": name})
    write_library(tmp_path, library.model_copy(update={"textures": (first, *library.textures[1:])}))
    return tmp_path


def output_of(lab, *arguments):
    return run_verb(textures, *arguments, "--lab", lab).stdout


def json_of(lab, *arguments):
    return json.loads(output_of(lab, *arguments, "--json"))


def refused(*arguments):
    """Return what the front door says of a mistake."""
    code, _, errors = run_command("textures", *arguments)
    assert code == 2
    return errors


def test_find_prints_what_was_understood_and_a_table(lab):
    lines = output_of(lab, "find", "rough, a bit sticky, not bumpy").splitlines()
    assert lines[:3] == [
        "rough: Rough-Smooth 0 to 38", "a bit sticky: Sticky-Slippery 25 to 50", "not bumpy: Flat-Bumpy 0 to 62",
    ]  # fmt: skip
    rows = [line.split() for line in lines if line.strip()[:1].isdigit()]
    assert [row[:3] for row in rows[:2]] == [["1", "T01", "sandpaper"], ["2", "T02", "sandpaper"]]
    assert (
        "16 people" in lines[5] and "predicted" in " ".join(rows[2]) and lines[-1].startswith("These textures are sim")
    )


def test_find_as_json_holds_the_wishes_and_every_number(lab):
    answer = json_of(lab, "find", "rough, soft 60-80", "-n", "1", "--predicted")
    assert [row["said"] for row in answer["wished"]] == ["rough", "soft 60 - 80"]
    (match,) = answer["found"]
    assert match["id"] == "T06" and match["fit"] == pytest.approx(match["fits"][0] * match["fits"][1])
    assert match["attributes"]["Rough-Smooth"] == pytest.approx(
        {"value": 12, "sd": 15 / 1.6448536, "low": -3, "high": 27, "from": "predicted"}
    )


def test_values_and_words_and_classes_go_together(lab):
    by_value = json_of(lab, "find", "--at", "Rough-Smooth=10", "--at", "Hard=85")
    by_words = json_of(lab, "find", "rough 90, hard 85")
    assert [row["id"] for row in by_value["found"]] == ["T01", "T05", "T02"]
    assert by_words["found"] == by_value["found"]
    assert [row["id"] for row in json_of(lab, "find", "rough", "--class", "mesh")["found"]] == ["T05"]
    assert [row["id"] for row in json_of(lab, "find", "rough", "--rated-only")["found"]] == ["T01", "T05", "T02"]


def test_where_nothing_fits_the_message_says_what_left_out_most(lab):
    output = output_of(lab, "find", "very soft, extremely slippery", "--sheet", lab / "none.png")
    assert "None of 6 textures fits. Most are left out by 'extremely slippery': 6 of 6. Without" in output
    assert "none.png was not written" in output and not (lab / "none.png").exists()


def test_nearest_and_show(lab):
    answer = json_of(lab, "nearest", "t01", "-n", "2")
    assert [row["id"] for row in answer["nearest"]] == ["T02", "T06"] and answer["texture"]["id"] == "T01"
    apart = answer["nearest"][0]["apart"]
    assert apart == {"Rough-Smooth": 1.0, "Flat-Bumpy": -1.0, "Sticky-Slippery": 0.5, "Hard-Soft": 0.5}
    assert output_of(lab, "nearest", "T01").startswith(
        "T01 (sandpaper 01): extremely rough, a bit flat, sticky, very hard"
    )
    shown = output_of(lab, "show", "T02")
    assert "20.0 (17 to 23, SD 8.0)" in shown and "35.0 (20 to 50)" in shown and "most like it: T01" in shown
    whole = json_of(lab, "show", "T02")
    assert whole["words"] == "very rough, flat, a bit sticky, very hard" and whole["predicted"]["high"][0] == 50
    assert len(json_of(lab, "show")["textures"]) == 6 and "T06" in output_of(lab, "show")


def test_show_tells_only_what_was_requested(lab):
    rated, predicted = (output_of(lab, "show", "T02", flag) for flag in ("--rated-only", "--predicted"))
    assert "20.0 (17 to 23" in rated and "35.0 (20 to 50)" not in rated and "predicted" not in rated
    assert rated.startswith("T02 (sandpaper 02) (sandpaper): very rough") or rated.startswith("T02, sandpaper 02")
    assert "35.0 (20 to 50)" in predicted and "20.0 (17 to 23" not in predicted and "rated by" not in predicted
    assert "most like it: T06" in predicted and "T01" not in predicted
    only = json_of(lab, "show", "T02", "--rated-only")
    assert only["rated"]["mean"][0] == 20 and only["predicted"] is None
    assert json_of(lab, "show", "T02", "--predicted")["words"].startswith("perhaps rough")


def test_a_picture_into_a_folder_that_is_not_there_is_refused_and_nothing_is_made(lab):
    for arguments in (
        ["find", "rough", "--sheet", lab / "no" / "a.png"], ["show", "--sheet", lab / "no" / "a.jpg"],
        ["nearest", "T01", "--sheet", lab / "no" / "a.png"], ["map", "--to", lab / "no" / "a.svg"],
        ["find", "rough", "--sheet", lab / "a.png", "--map", lab / "no" / "b.png"],
    ):  # fmt: skip
        assert f"there is no folder {lab / 'no'}" in refused(*arguments, "--lab", lab)
    assert not (lab / "no").exists() and not (lab / "a.png").exists()


def test_sheets_and_maps_are_written_and_named(lab):
    files = json_of(lab, "find", "rough", "--sheet", lab / "found.png", "--map", lab / "plane.png")["files"]
    assert [name.rsplit("/", 1)[1] for name in files] == ["found.png", "plane.svg", "plane.png"]
    with Image.open(lab / "found.png") as sheet:
        assert max(abs(a - b) for a, b in zip(sheet.getpixel((100, 200)), (200, 30, 40), strict=True)) < 6
    assert f"Look at {lab / 'near.jpg'}" in output_of(lab, "nearest", "T01", "--sheet", lab / "near.jpg")
    assert json_of(lab, "show", "T01", "--sheet", lab / "one.png")["files"] == [str(lab / "one.png")]
    assert "marked: T01, T05, T06, T02" in output_of(lab, "map", "very rough")
    assert (lab / "library" / "map.png").is_file() and json_of(lab, "map")["marked"] == []


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["find"], "what is wished for?"),
        (["find", "ruogh"], "did you mean 'rough'"),
        (["find", "rough and smooth"], "contradict each other"),
        (["find", "rough", "--class", "meshes"], "did you mean 'mesh'"),
        (["find", "rough", "--rated-only", "--predicted"], "one of the two is expected"),
        (["find", "rough", "--sheet", "x.gif"], ".png or .jpg"),
        (["find", "rough", "--sheet", "x.png", "--map", "./x.png"], "both to be written to"),
        (["nearest", "T99"], "no texture 'T99'"),
        (["show", "T99"], "no texture 'T99'"),
        (["show", "T01", "--predicted"], "T01: no model predicted it"),
        (["find", "rougher"], "compares"),
        (["find", "--at", "Rough"], "--at 'Rough': WORD=VALUE is expected"),
        (["map", "--at", "Rough=sand"], "--at 'Rough=sand': WORD=VALUE is expected"),
        (["index", "--model", "x.json", "--without-model"], "--without-model and --model x.json: one of the two"),
        (["find", "--at", "Rough=-5"], "-5 is not on the scale, 0 to 100"),
        (["index", "--scale", "1", "7"], "--scale goes with --folder"),
        (["index", "--folder", ".", "--sessions", "real"], "--folder takes none of them"),
        (["map", "--to", "x.pdf"], ".svg and .png"),
    ],
)
def test_a_mistake_is_reported_without_a_traceback(lab, arguments, expected):
    assert expected.lower() in refused(*arguments, "--lab", lab).lower()


def test_in_a_lab_without_a_library_the_message_says_how_to_make_one(tmp_path):
    assert "`palpate textures index` makes it" in refused("find", "rough", "--lab", tmp_path)


@pytest.mark.parametrize("arguments", [("find", "rough"), ("nearest", "T01"), ("show", "T01"), ("show",)])
def test_the_questions_load_nothing_heavy(lab, arguments):
    code = (
        (
            "import sys\nfrom palpate import command_line\n"
            f"try: command_line.main(['textures', *{arguments!r}, '--lab', {str(lab)!r}])\n"
            f"except SystemExit as ended: assert not ended.code\n"
            f"sys.exit(' '.join(sorted({HEAVY.split()!r} & {{n.partition('.')[0] for n in sys.modules}})) or 0)"
        )
        .replace("['torch'", "{'torch'")
        .replace("'librosa']", "'librosa'}")
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_verb_stands_at_the_front_door_with_the_maker_of_simulated_ones():
    assert command_line.VERBS["textures"][0] == "palpate.modeling.commands_library:textures"
    assert set(textures.commands) == {"index", "find", "nearest", "show", "map", "draw", "simulate"}
