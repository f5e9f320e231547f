"""Files of other programs: one writer each."""
