"""Latin keys write Hangul as a Korean keyboard does, key by key, and take it back key by key."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.devices.window.hangul import FIRST, KEYS, LAST, joined, needed, parts, shortened, syllable
from palpate.protocols.forms import Demographics, Lexicon, Question, Words
from tests.devices.window.screens.pages import Hand

WRITTEN = {
    "dkssudgktpdy": "안녕하세요", "anj": "뭐", "ekfr": "닭", "ekfrdl": "닭이", "ekfrl": "달기", "rkqtdl": "값이",
    "dlfrek": "읽다", "dlfrj": "일거", "zz": "ㅋㅋ", "zzk": "ㅋ카", "Rkw": "깢", "Qkfek": "빨다", "dOdO": "얘얘",
    "dPrks": "예간", "tnlqek": "쉽다", "dmltk": "의사", "Ekrek": "딱다", "dlTdj": "있어", "dlTj": "이써",
    "gnpfj": "훼러",
    "kk": "ㅏㅏ", "hk": "ㅘ", "hkr": "ㅘㄱ", "rkE": "가ㄸ", "rkEk": "가따", "DKS": "안", "rkr rk": "각 가",
    "ank1": "무ㅏ1",
}  # fmt: skip


def typed(form, keys, name, hangul=True, **more):
    hand = Hand(form, hangul=hangul, **more).tap(name)
    return hand.type(keys)


@pytest.mark.parametrize(("keys", "text"), WRITTEN.items())
def test_keys_write_what_they_write_on_a_korean_keyboard(keys, text):
    assert typed(Lexicon(1), keys, "words").screen.field.writing.text == text


def test_backspace_takes_one_key_back_while_a_syllable_is_composed_and_a_whole_one_before_it():
    hand, seen = typed(Lexicon(0), "dkfrhk", "words"), []
    for _ in range(4):
        seen.append(hand.screen.field.writing.text)
        hand.key("backspace")
    assert seen == ["알과", "알고", "알ㄱ", "알"] and hand.screen.field.writing.text == ""
    hand = typed(Lexicon(0), "ekfr", "words").key("left", "right", "backspace")
    assert hand.screen.field.writing.text == "", "a caret that was moved has ended the syllable"


def test_a_caret_that_was_moved_begins_a_new_syllable():
    hand = typed(Lexicon(0), "rkek", "words").key("left").type("s").key("end").type("s")
    assert hand.screen.field.writing.text == "가ㄴ다ㄴ"


def test_a_key_switches_between_hangul_and_latin():
    hand = typed(Lexicon(0), "rk", "words").key("hangul").type("USB").key("hangul").type("rk")
    assert hand.screen.field.writing.text == "가USB가"


def test_every_field_composes_and_numbers_stay_numbers():
    form = Demographics((Question("age", "?", "number"), Question("job", "?", "text")))
    hand = typed(form, "34", "question 0 field").tap("question 1 field").type("rytn").tap("next")
    assert hand.value["answers"] == {"age": 34, "job": "교수"}
    hand = typed(Words(("a", "b"), further=True), "Ejfxjqm, ", "further").type("thak").tap("next")
    assert hand.value["answers"]["further"] == ["떨터브", "소마"]


@pytest.mark.needs("fonts")
def test_the_hint_names_the_key_only_where_it_works():
    for form in (Lexicon(1), Words(("a", "b"), further=True)):
        assert "F9" in Hand(form, language="ko", hangul=True).text("hint")
        assert "F9" not in Hand(form, language="ko").text("hint")
    assert "F9" not in Hand(Words(("a", "b")), language="ko", hangul=True).text("hint")


def test_elsewhere_latin_stays_latin():
    assert typed(Lexicon(0), "rk", "words", hangul=False).key("hangul").type("rk").screen.field.writing.text == "rkrk"


@pytest.mark.parametrize(
    ("language", "platform", "so"),
    [
        ("ko", "linux", True),
        ("ko-KR", "freebsd14", True),
        ("ko", "win32", False),
        ("ko", "darwin", False),
        ("en", "linux", False),
    ],
)
def test_hangul_is_composed_where_nothing_else_composes_it(language, platform, so):
    assert needed(language, platform) is so


@given(st.integers(FIRST, LAST).map(chr))
def test_every_syllable_is_its_parts_as_unicode_has_it(character):
    assert syllable(*parts(character)) == character
    assert len(unicodedata.normalize("NFD", character)) == len([part for part in parts(character) if part])


@given(st.text(sorted(KEYS), min_size=1, max_size=30))
def test_whatever_is_typed_can_be_taken_back_key_by_key_while_it_is_composed(keys):
    now = ""
    for key in keys:
        last, then = now[-1:], joined(now[-1:], KEYS[key])
        assert 1 <= len(then) <= 2
        if len(then) == 1 and last:
            assert shortened(then) == last
        now = now[:-1] + then
    assert unicodedata.is_normalized("NFC", now)
