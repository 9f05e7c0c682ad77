"""Names of the files of a report."""

REPORT_FILES = ("report.html", "report.pdf")
