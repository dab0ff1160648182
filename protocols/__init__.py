"""What a study is and how a trial goes: pure and deterministic, with no hardware, no database and no clock."""

if __name__ != "palpate.protocols":
    raise ImportError("this package is palpate.protocols: from palpate import protocols")
