"""A made-up library: textures whose attributes are written down here."""

from palpate.modeling.library.entries import Entry, Library, Predicted, Rated

PAIRS = (("Rough", "Smooth"), ("Flat", "Bumpy"), ("Sticky", "Slippery"), ("Hard", "Soft"))


def rated(*mean, se=2.0, raters=16):
    return Rated(mean=mean, sd=tuple(se * raters**0.5 for _ in mean), se=tuple(se for _ in mean), raters=raters)


def predicted(*value, half=15.0, learned=False):
    low, high = (tuple(number + way * half for number in value) for way in (-1, 1))
    return Predicted(value=value, low=low, high=high, learned=learned)


def entry(name, category="wood", **parts):
    return Entry(id=name, label=f"{category} {name[1:]}", category=category, **parts)


def small_library(*entries, **others):
    """Six textures: sandpaper is rough and hard, foam soft, glass smooth; one is only predicted, one is both."""
    own = entries or (
        entry("T01", "sandpaper", rated=rated(10, 40, 35, 15)),
        entry("T02", "sandpaper", rated=rated(20, 30, 40, 20), predicted=predicted(35, 30, 40, 20)),
        entry("T03", "foam", rated=rated(55, 45, 30, 90)),
        entry("T04", "glass", rated=rated(97, 3, 80, 2)),
        entry("T05", "mesh", rated=rated(15, 90, 60, 20)),
        entry("T06", "leather", predicted=predicted(12, 38, 36, 60)),
    )
    return Library(attributes=PAIRS, textures=own, **others)
