"""Options of a survey for the commands of studies."""

import argparse

from headless import survey

from seip_addon.core.site.candidates import PAPER_TYPES


def add_survey_options(parser: argparse.ArgumentParser) -> None:
    """Add the scene, the folder of results and the options of a survey to the command of a study.

    Studies use the sensor types of the paper by default, and their help only names the options of a survey.
    """
    groups = survey.add_options(parser)
    parser.set_defaults(sensor=PAPER_TYPES)
    for group in groups:
        _name_only(group, "see: seip place --help")


def add_rolling_shutter(group: argparse._ActionsContainer) -> None:
    """Add the option that lets traffic stand still while sensors turn, to a command for which it moves."""
    group.add_argument(
        "--rolling-shutter",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="rolling shutter: traffic moves during a revolution, and boxes are at the time of their points (on)",
    )


def _name_only(group: argparse._ArgumentGroup, reference: str) -> None:
    """Replace the help of a group of options by their names and a reference."""
    names = (action.option_strings[-1] for action in group._group_actions)  # noqa: SLF001 -- argparse has no other way
    group.description = f"{' '.join(names)} ({reference})"
    for action in group._group_actions:  # noqa: SLF001 -- as above
        action.help = argparse.SUPPRESS
