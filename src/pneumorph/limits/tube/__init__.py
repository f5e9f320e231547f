"""Limits on tubes: their samples and cells, what is measured at them, and enclosures of it."""
