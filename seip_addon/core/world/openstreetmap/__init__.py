"""OpenStreetMap: an extract's streets as an OpenDRIVE map, and what stands beside them."""
