"""Features of recordings and pictures, and the attributes predicted from them."""
