"""The `pneumorph` command, also as `python -m pneumorph`."""

from pneumorph import interrupts


def main() -> None:
    """Run the command; signals are received before anything that takes time is loaded."""
    interrupts.install()
    from pneumorph.cli import app

    app(prog_name="pneumorph")


if __name__ == "__main__":
    main()
