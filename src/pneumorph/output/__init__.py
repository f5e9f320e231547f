"""Pictures, tables and exports of a run."""
