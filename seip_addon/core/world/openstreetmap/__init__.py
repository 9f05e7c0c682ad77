"""OpenStreetMap: streets of an extract, laid out by netconvert, and the objects next to them."""
