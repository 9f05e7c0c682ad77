"""Options of a survey for the commands of studies."""

import argparse

from headless import survey
from headless.options import new_parser

from seip_addon.core.site.candidates import PAPER_TYPES


def study_parser(name: str, description: str) -> argparse.ArgumentParser:
    """Return the parser of a study of a scene, with the options of a survey; its sensors are by default the paper's.

    Parameters
    ----------
    name : str
        Name of the study.
    """
    parser = new_parser(f"seip study {name}", description)
    survey.add_options(parser)
    parser.set_defaults(sensor=PAPER_TYPES)
    return parser
