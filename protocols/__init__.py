"""Studies and the course of their trials: pure and deterministic, without hardware, database or clock."""

if __name__ != "palpate.protocols":
    raise ImportError("this package is palpate.protocols: from palpate import protocols")
