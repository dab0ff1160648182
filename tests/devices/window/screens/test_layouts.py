"""Every kind of screen, on every size of screen, in every language, with texts far longer than usual: nothing
overlaps, nothing is cut, everything can be pressed."""

from dataclasses import replace

import pytest

from palpate.devices.window.build import screen_for
from palpate.devices.window.geometry import WindowError, problems
from palpate.devices.window.inputs import Key
from palpate.devices.window.pictures import shown
from palpate.devices.window.screens.specimens import Wording, specimens, wording
from palpate.protocols.forms import Demographics, Question, Sliders, Words
from palpate.protocols.study import Attribute, Scale
from tests.devices.window.screens.pages import SIZES, ask, page

HINDI = Wording(
    seven=tuple((f"खींचने में आसान {n}", f"खींचने में कठिन {n}", "दरवाज़ा खोलने में कितना ज़ोर लगा, यह बताइए।") for n in range(7)),
    four=tuple((f"खुरदुरा {n}", f"चिकना {n}", "उँगली के नीचे सतह कितनी खुरदुरी लगती है।") for n in range(4)),
    labels=("बहुत", "थोड़ा", "कोई नहीं", "थोड़ा", "बहुत"),
    alike=("बिल्कुल अलग", "बिल्कुल एक जैसा"),
    sides=("वास्तविक", "आभासी"),
    words=tuple(f"हल्का-फुल्का {n}" for n in range(68)),
    own=("भारी", "क्षणिक झटका", "स्निग्ध"),
    items=tuple(f"प्रणाली का उपयोग करना आसान था और मुझे अच्छा लगा ({n})।" for n in range(5)),
    ends=("पूरी तरह असहमत", "पूरी तरह सहमत"),
    person=(("आपकी आयु कितनी है?", "वर्ष"), ("आप किस हाथ का उपयोग करते हैं?", ("बायाँ हाथ", "दायाँ हाथ", "दोनों हाथ"))),
    fields=(
        ("कौन-सी सतह ज़्यादा खुरदुरी थी?", ("पहली", "दूसरी", "दोनों एक जैसी")),
        ("यह कितना सुखद था?", ("बहुत असुखद", "बहुत सुखद")),
        ("यह कितना तेज़ था? पहला 10 था।", "अंक"),
        "इसने आपको किसकी याद दिलाई?",
    ),
    anchor="यह दरवाज़ा सबसे कठिन दरवाज़ा है। यह रेखा के दाएँ सिरे पर है।",
    free="दरवाज़ा कैसा लगा, अपने शब्दों में बताइए।",
    fit=("क्या आपको कोई ऐसी चोट या बीमारी है जो इस काम में बाधा डाले?", "क्या आप दाएँ हाथ से काम करते हैं?"),
    consent="मैं भाग लेने के लिए सहमत हूँ।\n\n" * 12,
    instructions="दरवाज़े को एक ही गति में पूरा खोलिए। फिर बताइए कि कैसा लगा।",
)
LONG = replace(
    wording("en"),
    seven=tuple(
        (
            f"Extraordinarily uncomfortable {n}",
            f"Disproportionately comfortable {n}",
            "How much the movement of the door, from the first pull to the stop, asked of your arm and shoulder.",
        )
        for n in range(7)
    ),
    labels=(
        "completely and utterly",
        "to some degree",
        "neither of the two",
        "to some degree",
        "completely and utterly",
    ),
    words=tuple(f"Uncomfortable, disagreeable {n}" for n in range(80)),
    items=tuple(
        f"Changes that I made with the sliders led to clearly different doors, every time I tried {n}" for n in range(9)
    ),
    ends=("Completely and utterly disagree", "Completely and utterly agree"),
    person=(
        ("How many years of experience have you got, counting cars and lorries of all kinds?", "years, rounded down"),
        ("Which hand do you prefer for heavy things?", tuple(f"Most of the time the left hand {n}" for n in range(5))),
        *(
            (f"How many kilometres have you been driving in the year before last year {n}?", "kilometres")
            for n in range(5)
        ),
    ),
    fields=(
        (
            "Which of the surfaces that you have just felt, one after the other, was the rougher one of the two?",
            tuple(f"The surface that I felt at {time} of the trial" for time in ("the beginning", "the very end")),
        ),
        ("How pleasant was it, all in all?", ("Extraordinarily uncomfortable", "Disproportionately comfortable")),
        ("How strong was it, if the first stimulus of this session is called ten?", "points, of any size"),
        "What did the vibration remind you of, if it reminded you of anything that you have felt before?",
    ),
    anchor="This is the door that is the hardest to pull of all the doors that you will feel in this session. " * 4,
    consent=wording("en").consent * 4,
)
WORDINGS = {"en": wording("en"), "ko": wording("ko"), "hi": HINDI, "long": LONG}


LANGUAGES = ("en", "ko", "hi")


@pytest.mark.parametrize(
    ("size", "words"),
    [
        pytest.param(size, words, marks=[pytest.mark.needs("fonts")] if words in ("ko", "hi") else [])
        for place, size in enumerate(SIZES)
        for words in ("long", LANGUAGES[place % 3])  # the longest texts on every size, and each language on some
    ],
)
def test_nothing_overlaps_is_cut_or_too_small(size, words):
    language = "ko" if words == "ko" else "en"
    on = page(SIZES[size], language, pages={"instructions": WORDINGS[words].instructions}, may_rest=words != "en")
    for name, specimen in specimens(WORDINGS[words]).items():
        screen = shown(specimen, on)
        for sheet in range(screen.sheets):
            screen._turn(sheet)
            screen.handle(Key("tab", False, 1.0))
            screen.handle(Key("enter", False, 1.0)) if not name.startswith("consent") else None
            assert problems(screen.placed(), on.metrics) == [], (name, sheet)


def test_a_longest_word_list_stays_on_one_sheet_on_the_smallest_screen():
    words = tuple(f"Word of {n} letters" for n in range(80))
    for size in ("1280x720 at 4", "1280x720 at 3.2"):
        assert screen_for(ask(Words(words, further=True)), page(SIZES[size]), 0).sheets == 1


@pytest.mark.needs("fonts")
def test_seven_lines_stay_on_one_sheet_in_both_languages_on_the_smallest_screen():
    for language in ("en", "ko"):
        form = specimens(wording(language))["sliders"].request
        assert screen_for(form, page(SIZES["1280x720 at 4"], language), 0).sheets == 1


@pytest.mark.parametrize("size", SIZES)
def test_the_line_is_127_mm_long_to_half_a_pixel(size):
    on = page(SIZES[size])
    lines = [element for element in shown(specimens()["sliders"], on).placed() if element.name.endswith(".line")]
    assert len(lines) == 7
    for line in lines:
        assert abs(line.box.width / on.metrics.px_per_mm - 127.0) <= 0.5 / on.metrics.px_per_mm


@pytest.mark.parametrize("size", SIZES)
def test_labels_and_ticks_stand_at_their_values_to_a_pixel(size):
    screen = shown(specimens()["sliders-labelled"], page(SIZES[size]))
    placed = {element.name: element.box for element in screen.placed()}
    tracks = {element.name: element for element in screen.scene() if element.name.startswith("slider ")}
    for row, track in enumerate(tracks.values()):
        line = track.line
        for n, (stroke, value) in enumerate(zip(track.strokes, (0, 25, 50, 75, 100), strict=True)):
            at = line.left + value / 100 * (line.width - 1)
            label = placed[f"row {row} label {n}"]
            assert abs(label.middle[0] - at) <= 1 and abs(stroke.left + (stroke.width - 1) / 2 - at) <= 1
            assert track.box.contains(stroke) and label.top >= track.box.bottom - 1
    assert not any(element.strokes for element in shown(specimens()["sliders"], page(SIZES[size])).scene()
                   if element.name.startswith("slider ")), "no ticks unless the study says so"  # fmt: skip


def test_another_length_is_drawn_as_asked():
    on = page(SIZES["1920x1080 at 3.6"], length_mm=200.0)
    line = next(element for element in shown(specimens()["similarity"], on).placed() if element.name.endswith(".line"))
    assert line.box.width == 720


def test_a_line_wider_than_the_screen_is_refused_with_the_width_that_it_needs():
    with pytest.raises(WindowError, match=r"127 mm .* at least 196 mm wide; this one has 128 mm"):
        screen_for(
            ask(Sliders((Attribute(low="a", high="b"),), SCALE)), page(replace(SIZES["1280x720 at 4"], px_per_mm=10)), 0
        )


@pytest.mark.parametrize(
    ("form", "text"),
    [
        (Words(("fine", "x" * 150)), "xxx"),
        (Sliders((Attribute(low="y" * 90, high="b"),), Scale.model_validate({"from": 0, "to": 1})), "yyy"),
        (Demographics((Question("q", "z" * 150, "text"),)), "zzz"),
    ],
)
def test_a_text_that_fits_at_no_size_is_refused_by_name(form, text):
    with pytest.raises(WindowError, match=rf"'{text}.* does not fit .*1280x720 px .*mm\); shorten"):
        screen_for(ask(form), page(), 0)


SCALE = Scale.model_validate({"from": 0, "to": 100})


def test_more_lines_than_fit_are_turned_over_evenly():
    form = Sliders(tuple(Attribute(low=f"a{n}", high=f"b{n}") for n in range(20)), SCALE)
    screen = screen_for(ask(form), page(), 0)
    counts = []
    for sheet in range(screen.sheets):
        screen._turn(sheet)
        counts.append(
            sum(element.name.startswith("slider") and element.kind == "target" for element in screen.placed())
        )
    assert screen.sheets > 1 and sum(counts) == 20 and max(counts) - min(counts) <= max(counts) // 2
