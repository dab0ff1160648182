"""The studies (data: one folder each) and what runs them: sessions, ledger, replay, collection."""

if __name__ != "palpate.studies":
    raise ImportError("this package is palpate.studies: from palpate import studies")
