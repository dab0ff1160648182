"""Tables of stimuli and files of profiles: read, or refused with the line."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from palpate.modeling.doors.reading import read_profile
from palpate.modeling.doors.reading_tables import read_table
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.profile_file import read_profile as read_by_the_door
from tests.modeling.doors.labs_for_doors import RECORDED

GOOD = ["angle_deg,force_N", *(f"{n / 10:.1f},{n % 7}" for n in range(621))]


@pytest.mark.parametrize(
    "lines",
    [
        GOOD, GOOD[:-1], [*GOOD, "62.1,0"], ["angle,force", *GOOD[1:]], [*GOOD[:9], "0.8,nan", *GOOD[10:]],
        [*GOOD[:9], "0.8,inf", *GOOD[10:]], [*GOOD[:9], "0.85,1", *GOOD[10:]], [*GOOD[:9], "0.8,1,1", *GOOD[10:]],
        [*GOOD[:9], "0.8,", *GOOD[10:]], [*GOOD[:9], "", *GOOD[10:]], [], [GOOD[0]], ["\ufeff" + GOOD[0], *GOOD[1:]],
        [*GOOD[:9], "0.8,1\ud800"[:5] + "\x00", *GOOD[10:]], [*GOOD[:9], "0.8,1e400", *GOOD[10:]],
    ],
)  # fmt: skip
def test_a_profile_file_is_read_or_refused_as_the_door_itself_does(tmp_path, lines):
    file = tmp_path / "door.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    try:
        expected = list(read_by_the_door(file))
    except (DoorDataError, ValueError) as refusal:
        with pytest.raises(ModelDataError, match=r"door\.csv") as ours:
            read_profile(file)
        assert str(ours.value).partition(":")[0] == str(refusal).partition(":")[0], "both name the same line"
    else:
        assert read_profile(file).tolist() == expected


def test_a_profile_that_is_no_text_or_no_file_is_refused(tmp_path):
    (tmp_path / "door.csv").write_bytes(b"\xff\xfe\x00")
    for name in ("door.csv", "none.csv", "."):
        with pytest.raises(ModelDataError, match=r"not a UTF-8 text file|no door profile can be read"):
            read_profile(tmp_path / name)


HEAD = ["id", "door", "variant", "file", "Soft", "Warm"]


@pytest.fixture
def table(tmp_path):
    """Writes a table of two stimuli, changed as a test wants, with profiles beside it; gives its path."""
    for name in ("BC3_g0", "K3_g0"):
        shutil.copyfile(RECORDED / "doors_small" / "profiles" / f"{name}.csv", tmp_path / f"{name}.csv")

    def write(head=HEAD, first=None, more=()):
        rows = [dict(zip(HEAD, ["a", "BC3", "g0", "BC3_g0.csv", "1.5", "-2"], strict=True)),
                dict(zip(HEAD, ["b", "K3", "g0", "K3_g0.csv", "10", "0"], strict=True)), *more]  # fmt: skip
        rows[0] |= first or {}
        lines = [",".join(head), *(",".join(row.get(name, "") for name in head) for row in rows)]
        (tmp_path / "doors.csv").write_text("\n".join(lines) + "\n", encoding="utf-8-sig")
        return tmp_path / "doors.csv"

    return write


WORDS = {"Soft": "Hard", "Warm": "Cold"}


def test_a_table_is_read_with_its_profiles_beside_it(table):
    head = [*HEAD, "Soft.sd", "group", "raters", "source"]
    data = read_table(table(head, {"Soft.sd": "2.5", "raters": "12", "group": "1", "source": "x"}), attributes=WORDS)
    assert (data.ids, data.doors, data.attributes, data.antonyms) == (
        ("a", "b"),
        ("BC3", "K3"),
        ("Soft", "Warm"),
        ("Hard", "Cold"),
    )
    assert data.rating.tolist() == [[1.5, -2.0], [10.0, 0.0]]
    assert data.sd[0, 0] == 2.5 and np.isnan(data.sd).sum() == 3
    assert (data.raters.tolist(), data.groups, data.source) == ([12, 0], ("1", ""), ("x", "b"))
    assert data.force_N[1].tolist() == list(read_by_the_door(table().parent / "K3_g0.csv"))
    assert data.made_from[0].startswith("doors.csv ") and not data.simulated


def test_the_attributes_are_those_of_the_study_unless_declared(table):
    with pytest.raises(ModelDataError, match="line 1: no column is called 'Soft'"):
        read_table(table())


def test_a_stimulus_tables_own_source_is_an_origin_and_groups_nothing(table):
    data = read_table(table([*HEAD, "source"], {"source": "measured"}), attributes=WORDS)
    assert data.source == ("a", "b")


def test_stimuli_with_one_profile_are_one_source(table):
    again = dict(zip(HEAD, ["c", "BC3", "g10", "BC3_g0.csv", "1", "1"], strict=True))
    assert read_table(table(more=[again]), attributes=WORDS).source == ("a", "b", "a")


@pytest.mark.parametrize(
    ("head", "first", "says"),
    [
        ([*HEAD, "Sofd"], {}, "line 1: no column is called 'Sofd'; did you mean 'Soft'"),
        (HEAD[:-1], {}, "line 1: a column 'Warm' is expected, the mean rating"),
        (HEAD[1:], {}, "line 1: a column 'id' is expected; found door"),
        ([*HEAD, "Soft"], {}, "the column 'Soft' appears there twice"),
        (HEAD, {"Soft": "10.5"}, "line 2: Soft is 10.5, a mean rating on the scale from -10 to 10"),
        (HEAD, {"Soft": "nan"}, "line 2: Soft is 'nan', a finite number"),
        (HEAD, {"Soft": ""}, "line 2: Soft is '', a finite number"),
        (HEAD, {"id": "b"}, "line 3: the stimulus 'b' appears there twice"),
        (HEAD, {"door": ""}, "line 2: the column 'door' is empty"),
        (HEAD, {"file": "none.csv"}, r"line 2: no door profile .*none\.csv"),
        (HEAD, {"file": "doors.csv"}, r"line 2: .*doors\.csv, line 1: found .* expected 'angle_deg,force_N'"),
        (HEAD, {"file": "K3_g0.csv"}, "2 stimuli, of one force profile"),
        ([*HEAD, "raters"], {"raters": "2.5"}, "line 2: raters is 2.5, a whole number"),
        ([*HEAD, "raters"], {"raters": "1e300"}, r"line 2: raters is 1e\+300, a whole number"),
        ([*HEAD, "source"], {"file": "K3_g0.csv", "source": "x"}, "2 stimuli, of one force profile"),
        ([*HEAD, "source"], {"source": "b"}, "2 stimuli, all of the source 'b'.*at least two sources"),
        ([*HEAD, "Soft.sd"], {"Soft.sd": "-1"}, r"line 2: Soft\.sd is -1, an SD of 0 or more"),
        (HEAD, {"door": "a,b"}, "line 2: 7 cells found, 6 columns"),
    ],
)
def test_a_table_that_is_not_right_is_refused_with_its_line(table, head, first, says):
    with pytest.raises(ModelDataError, match=says):
        read_table(table(head, first), attributes=WORDS)


def test_a_table_of_no_rows_or_no_text_is_refused(tmp_path):
    (tmp_path / "empty.csv").write_text(",".join(HEAD) + "\n")
    with pytest.raises(ModelDataError, match="no stimulus under the header"):
        read_table(tmp_path / "empty.csv", attributes=WORDS)
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(ModelDataError, match="not UTF-8"):
        read_table(tmp_path / "bytes.csv", attributes=WORDS)
    with pytest.raises(ModelDataError, match="cannot be read"):
        read_table(tmp_path / "none.csv")
