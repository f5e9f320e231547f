"""Pictures, tables, exports and the page of a run."""
