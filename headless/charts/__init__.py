"""Charts and pictures of robust placement, of placement in traffic and of detection."""
