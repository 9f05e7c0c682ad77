"""Measurements of LiDARs: sensor models, visibility of targets, returns from road users, traffic and its scans."""
