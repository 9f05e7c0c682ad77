"""Names of files in a folder of results that several programs write or read."""

POSE_ERROR_PICTURES = ("spread.png", "blame.png")
TRAFFIC_PICTURE = "time_seen.png"
REPORT_FILES = ("report.html", "report.pdf")
VERIFICATION_FOLDER = "verification"
"""Folder in that of a placement, for the verification of its installation."""
VERIFICATION_FILE = "verification.json"
VERIFICATION_PICTURE = "changes.png"
