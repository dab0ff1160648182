"""Results as sentences in the style of the APA, each with what was tested."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.analysis.first_look.analysed import Analysed, with_nan
from palpate.analysis.first_look.study_statistics import Row, Test
from palpate.analysis.statistics.apa import apa_f, apa_t

NOT_TESTED = "not tested; the reason stands below"


def headlines(found: Analysed) -> Iterator[tuple[str, str]]:
    """Each attribute with its first result in a sentence, or with a word that it was not tested."""
    for attribute in found.ratings.attributes:
        test = found.headline(attribute)
        if test is not None:
            told = "; ".join(sentence(row) for row in test.rows)
            yield attribute_title(found, attribute), told or NOT_TESTED


def attribute_title(found: Analysed, attribute: str) -> str:
    """An attribute with both of its words: `Easy-to-pull – Hard-to-pull`."""
    antonym = found.ratings.antonyms.get(attribute)
    return f"{attribute} – {antonym}" if antonym else attribute


def sentence(row: Row) -> str:
    """An effect and its test: `variant: F(4.20, 163.90) = 12.34, p < .001, ...`."""
    return f"{effect_name(row['Source'])}: {apa_f(with_nan(row))}"


def pair_sentence(row: Row) -> str:
    """A pair and its test, the p value adjusted by Holm's method."""
    adjusted = with_nan(row) | {"p_adjust": "holm", "p_corr": with_nan(row)["p_holm"]}
    return f"{row['A']} − {row['B']}: {apa_t(adjusted)}"


def all_sentences(tests: tuple[Test, ...] | list[Test]) -> Iterator[str]:
    """Every effect of every test, each with its attribute."""
    for test in tests:
        for row in test.rows:
            yield f"{test.attribute}, {sentence(row)}"


def effect_name(source: str) -> str:
    """An effect as a reader writes it: `car × variant`."""
    return source.replace(":", " × ")
