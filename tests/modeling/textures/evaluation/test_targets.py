from types import SimpleNamespace

import pytest

from palpate.modeling.textures.evaluation import targets
from palpate.modeling.textures.evaluation.targets import reached

SIX = ("a", "b", "c", "d", "e", "f")
GOOD = {"level": 1.0, "smoothed_gfc": 0.99, "envelope": 0.95, "cycle_excess": 0.01, "felt_dB": 1.0, "beyond": ""}
REFUSED = dict.fromkeys(GOOD) | {"beyond": ""}
SILENT = {**REFUSED, "level": 0.0, "envelope": 0.0, "felt_dB": 30.0, "beyond": "level smoothed_gfc envelope"}


def rows(method, *of):
    return [{"texture": texture, "method": method, **scores} for texture, scores in zip(SIX, of, strict=False)]


@pytest.fixture
def verdicts(monkeypatch):
    def verdicts_of_rows(*every):
        monkeypatch.setattr(
            targets, "texture_rows", lambda _evaluation: [row for rows_of_method in every for row in rows_of_method]
        )
        textures = tuple(dict.fromkeys(row["texture"] for row in every[0]))
        return dict(reached(SimpleNamespace(textures=textures, ceilings={})))

    return verdicts_of_rows


def test_all_textures_within_a_limit_reach_it(verdicts):
    sentences = verdicts(rows("foten_generative", *[GOOD] * 6))
    assert sentences["Smoothed GFC"].endswith(": reached.")
    assert "Against AR" not in sentences


def test_a_texture_that_was_refused_or_stayed_silent_is_not_passed_over(verdicts):
    sentences = verdicts(rows("foten_generative", GOOD, REFUSED, SILENT, GOOD, GOOD, GOOD))
    assert sentences["Smoothed GFC"].endswith("reached on 4 of 6, not on c, not evaluated on b.")
    assert sentences["Level"].endswith("reached on 4 of 6, not on c, not evaluated on b.")
    assert sentences["No limit cycle"].endswith("reached on 4 of 6, not on c, not evaluated on b.")


@pytest.mark.parametrize(("won", "verdict"), [(4, "(aim: 4): reached."), (3, "(aim: 4): not reached.")])
def test_ours_has_to_be_nearer_than_the_baseline_on_four_of_six(verdicts, won, verdict):
    worse, even_worse = {**GOOD, "felt_dB": 2.0}, {**GOOD, "beyond": "level", "felt_dB": 0.1}
    base = [even_worse, *[worse] * (won - 1), *[{**GOOD, "felt_dB": 0.5}] * (6 - won)]
    sentences = verdicts(rows("foten_generative", *[GOOD] * 6), rows("ar", *base))
    assert sentences["Against AR"] == f"Nearer on {won} of 6 textures {verdict}"


def test_where_ours_did_not_run_the_baseline_has_won(verdicts):
    sentences = verdicts(
        rows("foten_generative", GOOD, REFUSED), rows("ar", {**GOOD, "felt_dB": 2.0}, {**GOOD, "level": 3.0})
    )
    assert sentences["Against AR"] == "Nearer on 1 of 2 textures (aim: 2): not reached."


def test_nothing_is_reported_of_a_network_that_never_ran(verdicts):
    assert verdicts(rows("foten_generative", REFUSED)) == {}
