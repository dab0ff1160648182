"""The extension `thermal`: the device `thermal.plate`, and the need of the same name that presents warmth with it."""

from palpate.protocols.needs import Need, Taken

from .plate import COLUMNS, KIND

VERSION = "1.0"
NEED = Need("presents", {"thermal.plate": Taken()}, parameters=frozenset(COLUMNS))

DEVICES = {"plate": KIND}
NEEDS = {"plate": NEED}
