"""Features, data sets, networks, training, evaluation and export of trained models."""

if __name__ != "palpate.modeling":
    raise ImportError("this package is palpate.modeling: from palpate import modeling")
