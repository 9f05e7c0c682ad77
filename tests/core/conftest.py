"""Number of random cases: few in quick runs, all where slow tests run as well."""

import os


def pytest_configure(config):
    os.environ["SEIP_FEW_CASES"] = str(int("not slow" in config.getoption("markexpr")))
