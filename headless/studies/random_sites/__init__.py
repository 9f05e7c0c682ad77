"""Random sites to train detectors on: streets, what stands beside them, their ground and their traffic."""
