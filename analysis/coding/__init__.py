"""Free text that coders have put codes to: their tables read back, codes counted, and how far coders agree."""
