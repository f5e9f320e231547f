"""`python -m pneumorph` is the `pneumorph` command."""

from pneumorph.cli import app

if __name__ == "__main__":
    app(prog_name="pneumorph")
