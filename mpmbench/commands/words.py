"""The words after a command, by argparse: an error is one sentence, as everywhere else."""

import argparse
from collections.abc import Sequence
from typing import NoReturn

from mpmbench.settings.schema import BadInput, did_you_mean


class Words(argparse.ArgumentParser):
    """A parser of the words after a command; wrong ones raise `BadInput` with the command's name.

    Parameters
    ----------
    command : str
    sentence : str
        What the command does.
    example : str
        One line of it.
    """

    def __init__(self, command: str, sentence: str, example: str = "") -> None:
        super().__init__(
            f"python -m mpmbench {command}",
            description=sentence,
            epilog=f"For example: python -m mpmbench {command} {example}" if example else None,
            add_help=False,
            allow_abbrev=False,
        )
        self.command = command

    def error(self, message: str) -> NoReturn:
        """Raise `BadInput` for what argparse does not understand."""
        raise BadInput(f"{self.command}: {message}; see `{self.command} --help`")

    def options(self) -> list[str]:
        """Its options, with ``=`` behind those that take a value."""
        return [
            one if action.nargs == 0 else f"{one}="
            for action in self._actions
            for one in action.option_strings
        ]

    def read(self, arguments: Sequence[str]) -> argparse.Namespace:
        """The values of the words; raises `BadInput` for one that is unknown."""
        found, unknown = self.parse_known_args(list(arguments))
        for word in unknown:
            hint = did_you_mean(word.partition("=")[0], [one.rstrip("=") for one in self.options()])
            raise BadInput(f"{self.command} {word}: there is no such option{hint}")
        return found
