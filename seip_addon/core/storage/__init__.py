"""Files that are written whole or not at all: text, JSON, arrays; digests that key stored results."""
