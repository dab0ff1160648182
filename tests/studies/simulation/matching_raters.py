"""The raters of door_ratings at the profiles of door_matching, on the scale of the shipped models.

A rating r on door_ratings' scale is 100 (r - low) / (high - low) on the models', whose cards hold low and high. The
weights stay what they are per unit of a column: `python -m tests.studies.simulation.matching_raters` prints them as
study.yaml holds them, per SD of a column over the fourteen profiles, and the figures of the study's README.
"""

from statistics import mean, pstdev

from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study

DECIMALS = 2
LOW, HIGH = 10, 90


def study(name):
    return read_study(SHIPPED / name / "study.yaml").study


def column(matching_study, name):
    return [float(stimulus.columns[name]) for stimulus in matching_study.stimuli]


def expected():
    """attribute -> column (or intercept) -> weight."""
    from palpate.devices.models.lookup import SHIPPED as MODELS
    from palpate.signals.models.file import read_card

    ratings, matching = study("door_ratings"), study("door_matching")
    low, high = read_card(MODELS / "door-force.json").takes.scale
    stretch = 100.0 / (high - low)
    weights_of = {}
    for attribute, weights in ratings.simulation.latents.items():
        here, level = {}, weights.get("intercept", 0.0)
        for name in (term for term in weights if term != "intercept"):
            there, now = column(ratings, name), column(matching, name)
            here[name] = stretch * weights[name] * pstdev(now) / pstdev(there)
            level += weights[name] * (mean(now) - mean(there)) / pstdev(there)
        weights_of[attribute] = {**here, "intercept": stretch * (level - low) - 50.0}
    return weights_of


def felt():
    """(attribute, target) -> attribute -> what everybody feels, 0..100: no person's gain, bias or noise."""
    matching_study = study("door_matching")
    person = Perceiver(compile_plan(matching_study, ParticipantRow("P001")))
    return {
        (stimulus.columns["attribute"], int(stimulus.columns["target"])): {
            attribute.name: 50.0 + person.latent(attribute.name, stimulus) for attribute in matching_study.attributes
        }
        for stimulus in matching_study.stimuli
    }


def off_what_is_felt():
    """How far what the models predict for the fourteen lies from that, on average, 0..100."""
    from palpate.devices.door.making import NEUTRAL, maker_for

    maker, off = maker_for(None), []
    for (attribute, target), known in felt().items():
        designed = maker.design({**dict.fromkeys(maker.attributes, NEUTRAL), attribute: float(target)})
        off += [abs(known[name] - value) for name, value in zip(maker.attributes, designed.predicted, strict=True)]
    return mean(off)


def table_rows():
    """The rows of the README's table: where a wish of 10 and one of 90 come, and how far the other six move."""
    known = felt()
    for attribute in dict.fromkeys(name for name, _ in known):
        low, high = known[attribute, LOW], known[attribute, HIGH]
        others = mean(abs(high[name] - low[name]) for name in low if name != attribute)
        own = high[attribute] - low[attribute]
        yield f"| {attribute} | {low[attribute]:.0f} | {high[attribute]:.0f} | {own:+.0f} | {others:.0f} |"


if __name__ == "__main__":
    for attribute, weights in expected().items():
        terms = ", ".join(f"{name}: {value:.{DECIMALS}f}" for name, value in weights.items())
        print(f"    {attribute}: {{{terms}}}")
    print(*table_rows(), f"{off_what_is_felt():.1f}", sep="\n")
