"""Random sites to train detectors on: streets, objects next to them, ground and traffic."""
