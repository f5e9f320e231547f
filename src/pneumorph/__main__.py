"""The `pneumorph` command, also as `python -m pneumorph`."""

from pneumorph import interrupts


def main() -> None:
    """Run the command; signals are received before anything that takes time is loaded."""
    interrupts.install()
    from pneumorph.cli import app

    try:
        app(prog_name="pneumorph")
    except SystemExit as end:
        interrupts.leave(end.code)
        raise


if __name__ == "__main__":
    main()
