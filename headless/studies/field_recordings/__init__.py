"""Study of field recordings: verification and detection on recordings simulated from changed scenes."""
