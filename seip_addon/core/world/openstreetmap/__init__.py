"""OpenStreetMap: streets of an extract as an OpenDRIVE map, and the objects next to them."""
