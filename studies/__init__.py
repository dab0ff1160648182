"""The studies (data: one folder each) and what runs them: sessions, ledger, replay, collection."""
