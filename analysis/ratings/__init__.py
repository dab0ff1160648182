"""The long table of ratings: read from ledgers, checked against its design, described and saved."""
