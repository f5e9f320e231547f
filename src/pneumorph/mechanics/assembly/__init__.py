"""The total potential Π as a list of terms, and its derivatives: vectors, products and the factorised tangent."""
