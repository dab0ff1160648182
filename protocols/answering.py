"""How a simulated perceiver answers each form: plausible, keyed, and the same for a repeated request."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from palpate.protocols.events import Ask, Reply
from palpate.protocols.forms import Demographics, Form, Lexicon, Likert, Question, Sliders, Words
from palpate.protocols.keyed import normal, shuffled, uniform
from palpate.protocols.simulated_participants.perceiver import Perceiver

TICKED_WITHOUT_LATENT = -2.2
"""Logit of ticking a word without latents in the study's simulation: one in ten."""
VOCABULARY = (
    "smooth",
    "rough",
    "heavy",
    "light",
    "stiff",
    "soft",
    "even",
    "jerky",
    "warm",
    "cold",
    "pleasant",
    "cheap",
)
LONGEST_TRY = 5
AGES = (19, 64)


def rate(person: Perceiver, ask: Ask, form: Sliders) -> tuple[Reply, float]:
    """Rate the stimulus on every attribute."""
    return person.rate(ask, form)


def agree(person: Perceiver, ask: Ask, form: Form) -> tuple[Reply, float]:
    """Agree to every item, of a consent or of the eligibility questions."""
    return _after(person, ask, dict.fromkeys(form.items(), True))


def leave_empty(person: Perceiver, ask: Ask, form: Form) -> tuple[Reply, float]:
    """Leave all questions with free-text answers empty."""
    return _after(person, ask, dict.fromkeys(form.items(), ""))


def describe_oneself(person: Perceiver, ask: Ask, form: Demographics) -> tuple[Reply, float]:
    """Answer the lab's questions about the person."""
    return _after(person, ask, {question.name: _about_oneself(person, question) for question in form.questions})


def _after(person: Perceiver, ask: Ask, answers: dict[str, Any]) -> tuple[Reply, float]:
    """Return the reply and its seconds, with one answer time for each item."""
    return _taking(person, ask, answers, answers)


def _taking(person: Perceiver, ask: Ask, answers: dict[str, Any], items: Iterable[str]) -> tuple[Reply, float]:
    """Return the reply and its seconds, with one answer time for each of `items`."""
    seconds = round(math.fsum(person.seconds(ask, item) for item in items), 3)
    return Reply({"answers": answers, "seconds": seconds}), seconds


def compare(person: Perceiver, ask: Ask, form: Sliders) -> tuple[Reply, float]:
    """Rate while switching between the sides a few times; every switch takes a second or two."""
    reply, seconds = person.rate(ask, form)
    count = 2 + math.floor(5 * uniform(*person.moment("switches", ask, "")))
    gaps = [round(0.8 + 1.6 * uniform(*person.moment("switch", ask, str(n))), 3) for n in range(count)]
    switches = [{"to": form.sides[n % len(form.sides)], "at_s": round(sum(gaps[: n + 1]), 3)} for n in range(count)]
    explored = round(sum(gaps), 3)
    at_s = {name: round(explored + at, 3) for name, at in reply.value["at_s"].items()}
    total = round(explored + seconds, 3)
    return Reply({**reply.value, "at_s": at_s, "seconds": total, "switches": switches}), total


def author(person: Perceiver, ask: Ask, form: Sliders) -> tuple[Reply, float]:
    """Choose a setting, try it, change one attribute after another, and settle after a few tries."""
    tries, tried = _tries(person, ask), 0
    if ask.former is not None:
        # Which try the former answers were is known by what was wished; of equal wishes (a coarse scale) the last
        # counts, so that every try leads on.
        tried = max((n + 1 for n in range(tries) if _wish(person, ask, form, n) == ask.former), default=tries)
    wish = _wish(person, ask, form, tried)
    seconds = round(person.seconds(ask, f"try {tried}"), 3)
    go = {"go": "try"} if tried < tries else {}
    return Reply({**go, "answers": wish, "at_s": dict.fromkeys(wish, seconds), "seconds": seconds}), seconds


def feel_reference(person: Perceiver, ask: Ask, _form: Form) -> tuple[Reply, float]:
    """Feel a reference once, sometimes twice, then go on."""
    felt = (ask.previous or {"felt": 0})["felt"]
    wanted = 1 + (uniform(*person.moment("felt", ask, "")) < 0.3)
    seconds = round(person.seconds(ask, f"felt {felt}"), 3)
    go = {"go": "try"} if felt < wanted else {}
    return Reply({**go, "answers": {"felt": felt}, "seconds": seconds}), seconds


def _tries(person: Perceiver, ask: Ask) -> int:
    return 2 + math.floor((LONGEST_TRY - 1) * uniform(*person.moment("tries", ask, "")))


def _wish(person: Perceiver, ask: Ask, form: Sliders, tried: int) -> dict[str, float]:
    """Return the setting at the n-th try, at which attribute n is changed; after the last try it stays the same."""
    settled = min(tried, _tries(person, ask) - 1)
    scale = form.scale
    wish = {}
    for place, attribute in enumerate(form.attributes):
        times = sum(1 for n in range(1, settled + 1) if n % len(form.attributes) == place)
        share = uniform(*person.moment("wish", ask, f"{attribute.name} {times}"))
        wish[attribute.name] = scale.nearest(scale.low + share * (scale.high - scale.low))
    return wish


def tick_words(person: Perceiver, ask: Ask, form: Words) -> tuple[Reply, float]:
    """Tick the words that fit; sometimes add one."""
    ticked = [word for word in form.words if _fits(person, ask, word)]
    further: list[str] = []
    if form.further and uniform(*person.moment("further", ask, "")) < 0.1:
        further = list(_from_memory(person, ask, 1, without=form.words))
    return _taking(person, ask, {"ticked": ticked, "further": further}, ticked or form.words[:1])


def _fits(person: Perceiver, ask: Ask, word: str) -> bool:
    """Return whether the word is ticked, from its latents, the person's bias and noise, summed as a logit."""
    felt = TICKED_WITHOUT_LATENT
    if ask.trial is not None and word in person.simulation.latents:
        felt = person.latent(word, ask.trial.stimulus)
    leaning = person.simulation.bias_sd * normal(*person.trait("bias", word))
    return uniform(*person.moment("tick", ask, word)) < 1 / (1 + math.exp(-(felt + leaning)))


def write_words(person: Perceiver, ask: Ask, form: Lexicon) -> tuple[Reply, float]:
    """Write the words that come to mind."""
    count = form.at_least + math.floor(4 * uniform(*person.moment("words", ask, "")))
    words = _from_memory(person, ask, count)
    return _taking(person, ask, {"words": list(words)}, words)


def _from_memory(person: Perceiver, ask: Ask, count: int, without: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return words that come to mind; when they run out, repeat them with a number."""
    known = [word for word in person.simulation.vocabulary or VOCABULARY if word not in without]
    once = shuffled(known, *person.moment("memory", ask, ""))
    again = [f"{word} {times}" for times in range(2, count + 2) for word in once]
    return (*once, *again)[:count]


def rate_statements(person: Perceiver, ask: Ask, form: Likert) -> tuple[Reply, float]:
    """Rate each statement by points around the middle, shifted by its latent intercept."""
    middle, points = (form.questionnaire.points + 1) / 2, form.questionnaire.points
    answers = {}
    for name in form.items():
        leaning = person.simulation.latents.get(name, {}).get("intercept", 0.0)
        felt = middle + leaning + normal(*person.moment("noise", ask, name))
        answers[name] = min(max(round(felt), 1), points)
    return _after(person, ask, answers)


def _about_oneself(person: Perceiver, question: Question) -> Any:
    share = uniform(*person.trait("about oneself", question.name))
    match question.kind:
        case "choice":
            return question.levels[math.floor(share * len(question.levels))][0]
        case "number":
            # An adult's age; any other number is a share of the years since; always one that the question allows.
            youngest, oldest = AGES
            years = (oldest - youngest) * uniform(*person.trait("about oneself", "age"))
            drawn = round(youngest + years if question.name == "age" else share * years)
            above = drawn if question.low is None else max(drawn, question.low)
            return above if question.high is None else min(above, question.high)
        case _:
            return None if question.optional else "not stated"
