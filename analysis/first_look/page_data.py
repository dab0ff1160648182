"""The parts of a report about its data: numbers, participants, exclusions, and whether the design is complete."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.analysis.first_look.analysis import Analysis
from palpate.analysis.ratings.dataset import Exclusion, Ratings
from palpate.analysis.ratings.sample import sample_facts
from palpate.analysis.reports.tables import Head, Table, fixed, number, text_table, words
from palpate.protocols.wording import count, some

MOST_SEEDS = 6


def lead(ratings: Ratings) -> str:
    """Return a one-line summary of the data set."""
    people, given = count(len(ratings.participants), "participant"), count(len(ratings.table), "rating")
    if len(ratings.attributes) == 1:
        return f"{people}, {given}."
    return f"{people}, {given} on {len(ratings.attributes)} attributes."


def facts(ratings: Ratings) -> Iterator[tuple[str, str]]:
    """Yield the facts that this data set has, each with its name."""
    yield "Study" if "session" in ratings.table.columns else "Data set", ratings.name
    people = str(len(ratings.participants))
    if len(ratings.between) == 1:
        [factor] = ratings.between
        groups = ratings.table.groupby(factor)["participant"].nunique()
        sizes = ", ".join(f"{factor} {group}: {groups.get(group, 0)}" for group in ratings.levels(factor))
        people = f"{people} ({sizes})"
    yield "Participants", people
    yield from sample_facts(ratings.sample)
    yield "Ratings", f"{len(ratings.table):,}"
    factors = []
    for name in ratings.within:
        total = len(ratings.levels(name))
        counts = ratings.table.groupby("participant")[name].nunique()
        most = int(counts.max()) if len(counts) else 0
        factors.append(f"{name} ({total})" if most == total else f"{name} ({total}, of which each met {most})")
    yield "Within participants", ", ".join(factors) or "no factor"
    if ratings.scale is not None:
        low, high = (f"{end:g}".replace("-", "−") for end in (ratings.scale.low, ratings.scale.high))
        yield "Scale", f"{low} to {high}" + (f", steps of {ratings.scale.step:g}" if ratings.scale.step else "")
    # Where the stimuli and the answers come from, as far as the study says.
    if ratings.stimulus_sources:
        sources = ", ".join(f"{number:,} {source}" for source, number in ratings.stimulus_sources.items())
        yield "Stimuli", f"{sum(ratings.stimulus_sources.values()):,}: {sources}"
    if ratings.seeds:
        yield "Simulation seed" if len(ratings.seeds) == 1 else "Simulation seeds", some(ratings.seeds, MOST_SEEDS)
    if ratings.interrupted:
        yield "Interrupted sessions", f"{len(ratings.interrupted):,} included"
    yield "Left out", left_out(ratings.exclusions)
    merged = [line for line in ratings.exclusions if line.what == "averaged"]
    if merged:
        yield "Averaged", f"{_rows(merged):,} into {sum(line.into for line in merged):,}"
    if rows := _rows([line for line in ratings.exclusions if line.what == "rows"]):
        yield "Rows without a rating", f"{rows:,}"
    for name, text in (("Source", ratings.source), ("Licence", ratings.licence)):
        if text:
            yield name, text


def left_out(exclusions: tuple[Exclusion, ...]) -> str:
    """Return how much was left out, by kind, without averaged rows and rows that were no ratings."""
    parts = []
    for what in ("session", "participant"):
        lines = [line for line in exclusions if line.what == what]
        if lines:
            parts.append(f"{count(len(lines), what)} ({count(_rows(lines), 'rating')})")
    single = {what: _rows([line for line in exclusions if line.what == what]) for what in ("practice", "repeated")}
    parts += [count(rows, f"{what} rating") for what, rows in single.items() if rows]
    return ", ".join(parts) or "nothing"


def averaged(ratings: Ratings) -> tuple[int, int]:
    """Return how many ratings were averaged in reading, and into how many values; (0, 0) for none."""
    lines = [line for line in ratings.exclusions if line.what == "averaged"]
    return _rows(lines), sum(line.into for line in lines)


def check_words(analysis: Analysis) -> str:
    """Return the result of the design check as a sentence."""
    ratings, merged = analysis.ratings, averaged(analysis.ratings)[0] > 0
    if not analysis.design.ok:
        kinds = {problem.kind for problem in analysis.design.problems}
        if kinds & {"missing", "duplicate", "undeclared"}:
            return "The ratings do not fill the design; tests that need the cells named here were not made."
        return "The ratings have the problems that are named here; the tests were made with these ratings."
    wrong = ["missing", *(["repeated"] if not merged else []), *(["off the scale"] if ratings.scale else [])]
    claim = " or ".join([", ".join(wrong[:-1]), wrong[-1]] if len(wrong) > 1 else wrong)
    who = "Every participant kept" if any(e.what == "participant" for e in ratings.exclusions) else "Every participant"
    verdict = f"{who} rated every cell that the design asks for: nothing is {claim}."
    return (
        f"{verdict} A cell that held several ratings holds their mean; the ledger below says whose."
        if merged
        else verdict
    )


def inclusions(ratings: Ratings) -> Iterator[str]:
    """Yield notes on the included sessions that a reader must know."""
    if ratings.interrupted:
        several = len(ratings.interrupted) > 1
        what = f"{count(len(ratings.interrupted), 'interrupted session')} {'were' if several else 'was'} included"
        yield f"{what} on request and {'are' if several else 'is'} incomplete: {'; '.join(ratings.interrupted)}."


def exclusions(ratings: Ratings) -> Table:
    """Return the table of exclusions."""
    rows = [(line.what, line.who, line.why, f"{line.rows:,}") for line in ratings.exclusions]
    return text_table(("what", words("who"), words("why"), number("how many")), rows)


def participants(ratings: Ratings) -> Table:
    """Return each participant with groups, number of ratings and, for sessions, how they were answered."""
    has = [name for name in ("session", "revised", "response_time_s") if name in ratings.table.columns]
    heads = {"session": words("session"), "revised": number("revised"), "response_time_s": number("median response, s")}
    rows = []
    people = dict(iter(ratings.table.groupby("participant", sort=False)))
    for name in ratings.participants:
        own = people[name]
        cells = {
            "session": lambda own=own: ", ".join(dict.fromkeys(own["session"])),
            "revised": lambda own=own: f"{int(own['revised'].sum()):,}",
            "response_time_s": lambda own=own: fixed(own["response_time_s"].median(), 1),
        }
        groups = [", ".join(dict.fromkeys(own[factor])) for factor in ratings.between]
        rows.append((name, *groups, f"{len(own):,}", *(cells[column]() for column in has)))
    return text_table(("participant", *ratings.between, number("ratings"), *(heads[name] for name in has)), rows)


def inputs(ratings: Ratings) -> Table:
    """Return every input with its hash."""
    rows = [(entry.name, entry.note, entry.sha256) for entry in ratings.inputs]
    return text_table((words("input"), words("what"), Head("SHA-256", "hash")), rows)


def _rows(lines: list[Exclusion]) -> int:
    return sum(line.rows for line in lines)
