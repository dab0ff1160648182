"""What a study is and how a trial goes: pure and deterministic, with no hardware, no database and no clock."""
