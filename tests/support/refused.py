"""What is refused, in one readable line."""

import pytest

from pneumorph.errors import ProblemError


def refusal(action, *arguments, kind: type[Exception] = ProblemError) -> str:
    """The message of an action that is refused."""
    with pytest.raises(kind) as caught:
        action(*arguments)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable() and len(message) < 400
    return message
