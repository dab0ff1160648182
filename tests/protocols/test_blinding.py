"""What is taken out of texts where a study keeps something blind."""

import pytest

from palpate.protocols.blinding import aliases, hider
from tests.protocols.studies_for_tests import toy

STIMULI = [
    {"id": "cloth_AR", "columns": {"label": "cloth", "method": "AR", "model": "ar"}},
    {"id": "cloth_FoTEN", "columns": {"label": "cloth", "method": "FoTEN", "model": "foten_generative"}},
    {"id": "rubber", "columns": {"label": "Rubber", "method": "AR", "model": ""}},
]
BLIND = toy(stimuli=STIMULI, console={"blind": ["method", "model"]})


@pytest.mark.parametrize(
    ("text", "hidden"),
    [
        ("texture-cloth-ar.json: not a whole model", "texture-cloth-….json: not a whole model"),
        ("cloth_FoTEN is on the door", "… is on the door"),
        ("texture-cloth-foten_generative died", "texture-cloth-… died"),
        ("the artist is hard to part from", "the artist is hard to part from"),
        ("AR, foten: cloth_ar", "…, …: …"),
        ("no link", "no link"),
    ],
)
def test_ids_and_blind_levels_are_taken_out_as_whole_words(text, hidden):
    assert hider(BLIND)(text) == hidden
    assert hider(toy(stimuli=STIMULI))(text) == text


def test_what_the_console_shows_anyway_stays():
    assert hider(BLIND, ("label",))("Put in place: Rubber") == "Put in place: Rubber"
    assert hider(BLIND)("Put in place: Rubber") == "Put in place: …"


def test_stimuli_are_numbered_in_no_order_of_the_table():
    names = aliases(BLIND)
    assert sorted(names) == ["cloth_AR", "cloth_FoTEN", "rubber"] and len(set(names.values())) == 3
    assert aliases(toy(stimuli=STIMULI)) == {}
    many = toy(stimuli=[{"id": f"{n:03d}", "columns": {"m": "x"}} for n in range(50)], console={"blind": ["m"]})
    assert [int(name.split()[1]) for name in aliases(many).values()] == list(range(1, 51))
    assert list(aliases(many)) != sorted(aliases(many))
