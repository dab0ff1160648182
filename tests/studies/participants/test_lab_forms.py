import pytest

from palpate.studies.lab import ParticipantError
from palpate.studies.participants.lab_forms import consent_text, demand_filled, plain, unfilled
from palpate.studies.participants.lab_template import template_files


def fill(lab, name="consent.md"):
    text = (lab / name).read_text("utf-8")
    for blank in unfilled(text):
        text = text.replace(f"[{blank}]", "so and so")
    (lab / name).write_text(text, "utf-8")


@pytest.mark.parametrize("language", ["en", "ko"])
def test_the_screen_shows_plain_paragraphs_without_the_lines_for_paper(language):
    text = consent_text(None, language)
    assert not any(mark in text for mark in ("#", "**", "<!--", "____"))
    paragraphs = text.split("\n\n")
    assert len(paragraphs) == 7 and not any("\n" in paragraph for paragraph in paragraphs)
    assert len(unfilled(text)) >= 8


def test_a_new_lab_has_its_own_text_with_the_templates_blanks(home):
    assert consent_text(home.lab) == consent_text(None)
    (home.lab / "consent.md").write_text("# Mine\n\nYou *may*\nleave.\n")
    assert consent_text(home.lab) == "Mine\n\nYou *may* leave."
    assert consent_text(home.lab, "ko") == consent_text(None, "ko")


def test_blanks_are_named_and_links_and_boxes_are_none():
    text = "[date /\nevent] and [link](http://x) and [ref][1], [x] [ ] done [name, contact]. [x]: y\n"
    assert unfilled(text) == ["date / event", "name, contact"]
    assert unfilled("[ethics]: https://example.org") == []
    assert unfilled("Ask [name]: now.") == ["name"] and len(unfilled(f"[{'long ' * 60}]")) == 1


def test_a_consent_text_with_blanks_is_refused_until_they_are_filled_in(home):
    for language, name in (("en", "consent.md"), ("ko", "consent.ko.md")):
        with pytest.raises(ParticipantError, match=rf"{name}: not filled in: \[.*\], \.\.\. \(\d+ in all\); fill them"):
            demand_filled(home.lab, language)
        fill(home.lab, name)
        demand_filled(home.lab, language)


def test_the_templates_text_is_nobodys_consent(home):
    (home.lab / "consent.md").unlink()
    with pytest.raises(
        ParticipantError, match=r"lab/consent\.md: no such consent text; copy .*template/consent\.md ther"
    ):
        demand_filled(home.lab)


def test_an_empty_text_and_a_language_without_one_are_refused(home):
    (home.lab / "consent.md").write_text("\n<!-- on paper only -->\nName\n")
    with pytest.raises(ParticipantError, match="the consent text is empty"):
        demand_filled(home.lab)
    with pytest.raises(ParticipantError, match=r"consent\.fr\.md: there is no consent text in this language"):
        consent_text(home.lab, "fr")
    (home.lab / "consent.md").write_bytes(b"caf\xe9")
    with pytest.raises(ParticipantError, match="byte 3 is not UTF-8"):
        consent_text(home.lab)


def test_plain_text_keeps_its_words():
    assert plain("## A  b\nc\n\n\n**d** __e__ f_g <!-- no\n\nno -->h") == "A b c\n\nd e f_g h"


def test_every_text_of_the_template_has_blanks_that_are_found():
    for file in template_files():
        if file.suffix == ".md" and file.name != "README.md":
            assert unfilled(file.read_text("utf-8")), file
